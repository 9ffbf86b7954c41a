"""The agent when the tower, the holder or the sticks are lost, and late sticks and commands."""

from onboard_world import ALT_HOLD, RTL, STEP_S, World, frame, order, set_mode, sticks

from wire.content import Frames
from wire.control_messages import (
    ControlChanged,
    HoldCause,
)
from wire.dialect import mavlink
from wire.ids import DroneId, Epoch


def test_losing_the_tower_in_the_hand_holds() -> None:
    world = World()
    world.configure(sticks_stale_s=10.0)
    world.tower_sends(sticks(300))
    assert world.messages("MANUAL_CONTROL")
    world.onboard.link_broken(world.now)
    world.tower_there = False
    world.pass_time(1.9)
    assert not world.messages("MANUAL_CONTROL")
    world.pass_time(0.15)
    assert world.messages("MANUAL_CONTROL")
    assert world.steps() == [], "there is nobody to tell yet"
    world.link_up()
    world.pass_time(0.1)
    assert world.steps()[:3] == ["ordered", "sticks_centred", "mode_requested"]
    assert world.causes() == {HoldCause.PILOT_LOST}


def test_losing_the_holder_while_the_tower_lives_holds_too() -> None:
    world = World()
    world.configure(sticks_stale_s=10.0)
    world.tower_sends(sticks(300))
    assert world.messages("MANUAL_CONTROL")
    world.onboard.message(ControlChanged(epoch=5, holder="ada", holder_present=False), world.now)
    world.pass_time(1.9)
    assert not world.messages("MANUAL_CONTROL")
    world.pass_time(0.15)
    assert world.messages("MANUAL_CONTROL")


def test_a_holder_who_is_back_in_time_flies_on() -> None:
    world = World()
    world.configure(sticks_stale_s=10.0)
    world.tower_sends(sticks(300))
    world.onboard.message(ControlChanged(epoch=5, holder="ada", holder_present=False), world.now)
    world.pass_time(1.0)
    world.onboard.message(ControlChanged(epoch=5, holder="ada", holder_present=True), world.now)
    world.tower_sends(sticks(300))
    world.sent.clear()
    world.pass_time(3.0)
    assert not world.messages("MANUAL_CONTROL")


def test_sticks_that_stop_hold_and_want_to_be_centred_again() -> None:
    world = World()
    world.stream(1.0)
    world.messages("MANUAL_CONTROL")
    world.pass_time(0.45)
    assert not world.messages("MANUAL_CONTROL")
    world.pass_time(0.1)
    assert {m.x for m in world.messages("MANUAL_CONTROL")} == {0}
    assert world.steps() == ["ordered", "sticks_centred", "mode_requested"]
    assert world.causes() == {HoldCause.STICKS_STALE}
    world.tower_sends(sticks(300))
    assert sticks(300) not in world.sent
    world.tower_sends(sticks(0), sticks(300))
    assert sticks(300) in world.sent


def test_sticks_that_stop_in_a_mode_without_sticks_are_nothing() -> None:
    world = World(receiver=True)
    world.stream(1.0)
    world.tower_sends(set_mode(RTL))
    world.mode = RTL
    world.messages("MANUAL_CONTROL")
    world.pass_time(3.0)
    assert not world.messages("MANUAL_CONTROL")


def test_late_sticks_are_discarded_and_are_not_fresh() -> None:
    world = World()
    world.stream(1.0)
    world.sent.clear()
    for n in range(40):
        late_by_a_second = Frames(DroneId(7), Epoch(5), int((world.now - 1.0) * 1000), [sticks(700)])
        world.onboard.from_tower(late_by_a_second, world.now)
        world.pass_time(STEP_S)
        assert sticks(700) not in world.sent, n
    assert world.causes() == {HoldCause.STICKS_STALE}
    assert world.onboard.counts["sticks too late"] == 40


def test_a_late_command_is_never_executed() -> None:
    world = World()
    world.tower_sends(sticks(0))
    late = Frames(DroneId(7), Epoch(5), int((world.now - 2.5) * 1000), [set_mode(RTL)])
    world.onboard.from_tower(late, world.now)
    world.collect()
    assert set_mode(RTL) not in world.sent
    assert world.onboard.counts["command too late"] == 1
    world.link_up()
    world.onboard.from_tower(late, world.now)
    world.collect()
    assert set_mode(RTL) in world.sent, "another link, another clock"


def test_the_ladder_is_the_towers_and_outlives_the_link() -> None:
    world = World(mode=0)
    world.configure(hold_ladder=("BRAKE", "AUTO.LOITER"))
    world.onboard.link_broken(world.now)
    world.link_up()
    world.onboard.message(order(), world.now)
    world.onboard.tick(world.now)
    world.collect()
    assert world.modes_asked() == [17]
    refused = mavlink.MAVLink_command_ack_message(176, mavlink.MAV_RESULT_FAILED, 0, 0, 1, 191)
    world.onboard.from_autopilot([frame(refused)], world.now)
    world.collect()
    assert world.modes_asked() == [ALT_HOLD], "in the call that brought the refusal"


def test_an_epoch_without_an_order_fences_and_leaves_the_gate_as_it_is() -> None:
    world = World()
    world.stream(0.2)
    world.onboard.message(ControlChanged(epoch=6, holder="ada", holder_present=True), world.now)
    world.sent.clear()
    world.tower_sends(sticks(301), epoch=5)
    world.tower_sends(sticks(302), epoch=6)
    assert world.sent == [sticks(302)]
    assert world.steps() == []
