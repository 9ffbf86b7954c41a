"""The agent carries out hold orders: fence, centred sticks, the gate, confirmation."""

from onboard_world import ALT_HOLD, RTL, World, frame, order, set_mode, sticks

from wire.control_messages import (
    HoldProgress,
)
from wire.dialect import mavlink
from wire.frames import message_id


def test_an_order_fences_centres_and_confirms() -> None:
    world = World()
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.tower_sends(sticks(900), epoch=5)
    assert sticks(900) not in world.sent
    world.ack(176)
    world.mode = ALT_HOLD
    world.pass_time(0.1)
    assert world.steps() == ["sticks_centred", "mode_requested", "mode_acknowledged", "confirmed"]


def test_the_answer_to_somebody_elses_mode_change_does_not_count() -> None:
    world = World()
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.ack(176, target=(255, 190))
    assert "mode_acknowledged" not in world.steps()
    world.ack(176, target=(0, 0))
    assert "mode_acknowledged" in world.steps()


def test_a_gimbals_heartbeat_does_not_confirm() -> None:
    world = World()
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.ack(176)
    gimbal = frame(mavlink.MAVLink_heartbeat_message(26, 3, 0x81, ALT_HOLD, 4, 3), component_id=154)
    world.onboard.from_autopilot([gimbal], world.now)
    world.collect()
    assert "confirmed" not in world.steps()


def test_a_tower_that_was_restarted_may_count_its_orders_from_one_again() -> None:
    world = World()
    world.onboard.message(order(order_id=1, epoch=6), world.now)
    world.pass_time(0.1)
    world.link_up(epoch=6)
    world.onboard.message(order(order_id=1, epoch=7), world.now)
    world.pass_time(0.1)
    assert world.steps() == ["sticks_centred", "mode_requested"] * 2


def test_a_hold_that_a_fence_forbids_says_so() -> None:
    fence = mavlink.MAV_SYS_STATUS_GEOFENCE
    for healthy, said in ((0, True), (fence, False)):
        world = World()
        status = mavlink.MAVLink_sys_status_message(fence, fence, healthy, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
        world.onboard.from_autopilot([frame(status)], world.now)
        world.onboard.message(order(), world.now)
        world.pass_time(0.1)
        world.ack(176, result=mavlink.MAV_RESULT_FAILED)
        world.pass_time(3.2)
        (unconfirmed,) = [one for one in world.reported if isinstance(one, HoldProgress) and one.step == "unconfirmed"]
        assert ("outside its fence" in unconfirmed.detail) is said
        assert "refuses ALT_HOLD" in unconfirmed.detail


def test_uncentred_sticks_wait_and_centred_ones_take_over() -> None:
    world = World()
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.sent.clear()
    world.tower_sends(sticks(700), epoch=6)
    assert world.sent == []
    world.tower_sends(sticks(10), sticks(700), epoch=6)
    assert world.sent == [sticks(10), sticks(700)]
    world.sent.clear()
    world.pass_time(0.5)
    assert not world.messages("MANUAL_CONTROL")
    assert world.onboard.counts["sticks not centred after a hold"] == 1


def test_the_gate_stays_shut_for_as_long_as_it_takes() -> None:
    world = World()
    world.onboard.message(order(), world.now)
    world.pass_time(60.0)
    world.sent.clear()
    world.tower_sends(sticks(700), epoch=6)
    assert sticks(700) not in world.sent


def test_a_command_of_the_new_holder_takes_over() -> None:
    world = World(receiver=True)
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.tower_sends(set_mode(RTL), epoch=6)
    assert set_mode(RTL) in world.sent
    world.mode = RTL
    world.sent.clear()
    world.pass_time(1.0)
    assert {message_id(f) for f in world.sent} <= {0, 20, mavlink.MAVLINK_MSG_ID_COMMAND_LONG}
    assert not [m for m in world.messages("COMMAND_LONG") if m.command == 176]


def test_a_command_of_the_old_holder_does_not() -> None:
    world = World()
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    world.tower_sends(set_mode(RTL), epoch=5)
    world.sent.clear()
    world.pass_time(0.5)
    assert world.messages("MANUAL_CONTROL")
