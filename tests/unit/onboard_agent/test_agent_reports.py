"""The agent's reports to the tower, and its requests to the autopilot."""

from onboard_world import ALT_HOLD, RTL, STEP_S, World, frame, order, sticks

from onboard_agent.autopilot.parameters import LOSS_NAMES
from onboard_agent.link.tower_outbox import PROGRESS_KEPT
from wire.control_messages import (
    AutopilotState,
    ControlChanged,
    LossParameters,
)
from wire.dialect import mavlink
from wire.frames import message_id


def test_an_autopilot_that_is_found_only_after_the_order_is_put_into_the_hold() -> None:
    world = World(heard=False)
    world.onboard.message(order(), world.now)
    world.pass_time(0.5)
    assert world.modes_asked() == []
    world.heard = True
    world.pass_time(0.1)
    assert ALT_HOLD in world.modes_asked()


def test_the_loss_parameters_are_told_when_read_and_to_each_new_link() -> None:
    world = World(armed=False)
    for _ in range(100):
        world.pass_time(STEP_S)
        for request in world.messages("PARAM_REQUEST_READ"):
            if request.param_id != "RC_OPTIONS":
                value = mavlink.MAVLink_param_value_message(request.param_id.encode(), 1.0, 9, 900, 1)
                world.onboard.from_autopilot([frame(value)], world.now)
    assert not [m for m in world.reported if isinstance(m, LossParameters)], "one is not answered yet"
    world.pass_time(6.5)  # gives up two that a real ArduPilot may lack
    (reported,) = [m for m in world.reported if isinstance(m, LossParameters)]
    assert set(reported.values) == set(LOSS_NAMES[3]) - {"MAV_GCS_SYSID", "RC_OPTIONS", "SIM_SPEEDUP"}
    assert (reported.autopilot, reported.complete, reported.has_radio) == ("ardupilot", True, None)
    world.reported.clear()
    world.link_up()
    world.collect()
    assert reported in world.reported


def test_losing_the_tower_in_an_autonomous_mode_leaves_the_mission_alone() -> None:
    world = World(mode=RTL, receiver=True)
    world.tower_sends(sticks(300))
    assert world.messages("MANUAL_CONTROL")
    world.tower_there = False
    world.pass_time(5.0)
    assert not world.messages("MANUAL_CONTROL")


def test_losing_the_tower_on_the_ground_does_nothing() -> None:
    world = World(armed=False)
    world.tower_sends(sticks(300))
    assert world.messages("MANUAL_CONTROL")
    world.tower_there = False
    world.pass_time(5.0)
    assert not world.messages("MANUAL_CONTROL")


def test_an_order_for_an_autopilot_that_was_never_heard_is_told_and_carried_out_once_it_is() -> None:
    world = World(heard=False)
    world.onboard.message(order(), world.now)
    world.pass_time(3.1)
    assert world.steps()[-1] == "unconfirmed"
    assert not world.messages("MANUAL_CONTROL"), "it may be a rover, which would drive"
    world.heard = True
    world.pass_time(0.5)
    assert world.messages("MANUAL_CONTROL")


def test_progress_waits_for_a_link_within_a_bound() -> None:
    world = World(armed=False)
    world.onboard.link_broken(world.now)
    for n in range(PROGRESS_KEPT + 20):
        world.onboard.message(order(order_id=n + 1), world.now)
        world.beat()
        world.collect()
    assert world.steps() == []
    world.link_up()
    world.collect()
    assert len(world.steps()) == PROGRESS_KEPT


def test_the_state_is_told_on_change_and_to_each_new_link() -> None:
    world = World()
    states = [m for m in world.reported if isinstance(m, AutopilotState)]
    assert states[-1] == AutopilotState(heard=True, armed=True, airborne=False, system_id=1, hears_agent=True)
    world.pass_time(60.0)
    world.reported.clear()
    world.pass_time(1.0)
    assert world.reported == []
    world.link_up()
    world.collect()
    assert [m for m in world.reported if isinstance(m, AutopilotState)] == [
        AutopilotState(heard=True, armed=True, airborne=False, system_id=1, hears_agent=True)
    ]


def test_a_ground_station_beats_while_the_holder_is_there_and_the_tower_heard() -> None:
    world = World()

    def ground_station_beats(for_s: float) -> int:
        world.sent.clear()
        world.pass_time(for_s)
        return sum(m.type == mavlink.MAV_TYPE_GCS for m in world.messages("HEARTBEAT"))

    assert ground_station_beats(3.0) == 0
    world.onboard.message(ControlChanged(epoch=5, holder="ada", holder_present=True), world.now)
    assert ground_station_beats(3.0) == 3
    world.tower_there = False
    assert 1 <= ground_station_beats(10.0) <= 2
    world.tower_there = True
    assert ground_station_beats(3.0) == 3
    world.onboard.link_broken(world.now)
    assert ground_station_beats(3.0) == 0


def test_rates_and_parameters_are_asked_again_after_a_reboot() -> None:
    world = World()
    world.pass_time(60.0)
    world.sent.clear()
    for boot_ms in (50_000, 900):
        position = mavlink.MAVLink_global_position_int_message(boot_ms, 0, 0, 0, 0, 0, 0, 0, 0)
        world.onboard.from_autopilot([frame(position)], world.now)
    world.pass_time(1.0)
    kinds = {message_id(f) for f in world.sent}
    assert mavlink.MAVLINK_MSG_ID_COMMAND_LONG in kinds
    assert mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ in kinds


def test_a_frame_that_cannot_be_read_still_goes_to_the_tower() -> None:
    world = World()
    strange = frame(mavlink.MAVLink_heartbeat_message(2, 3, 1, 5, 4, 3), component_id=77)
    unknown = bytes([0xFD, 1, 0, 0, 1, 1, 1, 0x60, 0xEA, 0, 5, 9, 9])
    assert world.onboard.from_autopilot([strange, unknown], world.now) == [strange, unknown]
