"""The agent's process dies and restarts while the drone is held, or flown by hand: two Onboards, one store."""

import pytest
from held_flights import flown, sinks, taken
from worlds.held_copter import HeldCopter, mode_command
from worlds.model_copter import Mode, ModelCopter, Receiver

from wire.open_holds import HoldStage, LostPhase

WITH_RECEIVER = [Receiver.LOW, Receiver.CENTRED]


def commanded_alone(world: HeldCopter) -> bool:
    return {change.why for change in world.copter.changes} <= {"commanded"}


@pytest.mark.parametrize("receiver", WITH_RECEIVER)
@pytest.mark.parametrize("held_s", [0.05, 0.5, 1.2])
def test_in_stage_one_sticks_are_back_before_the_receivers(receiver: Receiver, held_s: float) -> None:
    world = taken(receiver, after_s=held_s)
    height_m, died_at = world.copter.height_m, world.now
    world.restart_agent()
    world.pass_time(0.1)
    assert world.longest_gap_s(died_at) <= 1.2
    world.pass_time(5.0)
    assert (world.copter.mode, world.agent.hold.open) == (Mode.BRAKE, True)
    assert not sinks(world, height_m)
    assert commanded_alone(world)


@pytest.mark.parametrize("receiver", WITH_RECEIVER)
def test_in_stage_two_it_stays_and_is_told_as_open(receiver: Receiver) -> None:
    world = taken(receiver)
    height_m = world.copter.height_m
    world.restart_agent()
    world.link_up()
    world.pass_time(3.0)
    assert (world.copter.mode, world.state.open, world.state.stage) == (Mode.BRAKE, True, HoldStage.STAY)
    assert "started again" in world.state.detail or world.state.phase is LostPhase.COUNTING
    assert not sinks(world, height_m)
    world.pass_time(29.0)
    assert world.copter.mode is Mode.RTL, "and the person is counted"


@pytest.mark.parametrize("receiver", WITH_RECEIVER)
def test_who_flew_by_hand_is_held(receiver: Receiver) -> None:
    world = flown(receiver, hand=(800, 500))
    height_m = world.copter.height_m
    world.restart_agent()
    world.pass_time(5.0)
    assert (world.copter.mode, world.agent.hold.open) == (Mode.BRAKE, True)
    assert not sinks(world, height_m)
    assert "was flown by hand" in world.agent.hold.why


@pytest.mark.parametrize("dead_s", [1.2, 2.0, 8.0])
@pytest.mark.parametrize("by_hand", [True, False])
def test_the_autopilots_own_return_goes_on_and_is_told(dead_s: float, by_hand: bool) -> None:
    """Without a receiver the autopilot has begun a return by then."""
    world = flown(Receiver.NONE, hand=(300, 500)) if by_hand else taken(Receiver.NONE)
    world.restart_agent(after_s=dead_s)
    assert world.copter.mode is Mode.RTL
    world.link_up(present=False)
    world.pass_time(40.0)
    assert [change.why for change in world.copter.changes].count("radio failsafe") == 1, "it is not begun again"
    assert not world.copter.armed
    assert "commanded" not in [change.why for change in world.copter.changes[-1:]]


def test_a_landing_goes_on() -> None:
    world = taken()
    world.kill_agent()
    world.copter.switch(Mode.LAND)
    world.pass_time(1.0)
    world.begin_agent()
    world.link_up()
    world.pass_time(3.0)
    assert world.copter.mode is Mode.LAND
    assert not world.state.open


def test_what_was_ended_in_good_order_is_forgotten() -> None:
    world = taken()
    world.send(mode_command(Mode.GUIDED))
    world.pass_time(1.0)
    world.restart_agent()
    world.link_up()
    world.pass_time(3.0)
    assert world.copter.mode is Mode.GUIDED
    assert not world.state.open


def test_one_that_was_disarmed_meanwhile_is_not_held() -> None:
    world = taken()
    world.kill_agent()
    world.copter.armed = False
    world.copter.height_m = world.copter.climb_m_s = 0.0
    world.pass_time(2.0)
    world.begin_agent()
    world.link_up()
    world.pass_time(3.0)
    assert world.copter.mode is Mode.BRAKE
    assert not world.state.open
    world.sticks.clear()
    world.pass_time(2.0)
    assert world.sticks == []


def test_no_mode_is_asked_for_before_a_heartbeat() -> None:
    world = taken(after_s=0.1)
    world.kill_agent()
    world.pass_time(1.0)
    world.begin_agent()
    world.copter.mute = True
    world.agent_sent.clear()
    died_at = world.now
    world.pass_time(2.0)
    assert world.modes_asked() == []
    assert world.longest_gap_s(died_at) <= 0.3
    world.copter.mute = False
    world.pass_time(0.3)
    assert world.modes_asked() != []


def test_an_autopilot_that_stays_silent_is_given_up() -> None:
    world = taken(after_s=0.5)
    world.kill_agent()
    world.begin_agent()
    world.copter.mute = True
    world.pass_time(32.0)
    world.sticks.clear()
    world.pass_time(2.0)
    assert world.sticks == []


def test_a_record_that_cannot_be_read_is_none() -> None:
    world = taken()
    world.kill_agent()
    world.store.record = b'{"of": "another version"'
    world.begin_agent()
    world.link_up()
    world.pass_time(2.0)
    assert world.copter.mode is Mode.BRAKE
    assert not world.state.open


def test_settings_of_the_drone_outlast_the_process() -> None:
    world = taken(lost_action_s=8.0)
    world.restart_agent()
    world.pass_time(9.0)
    assert world.copter.mode is Mode.RTL, "without a tower that says so again"


def test_a_second_death_is_survived_as_well() -> None:
    world = taken()
    for _ in range(3):
        world.restart_agent()
        world.pass_time(0.6)
    world.pass_time(3.0)
    assert (world.copter.mode, world.agent.hold.open) == (Mode.BRAKE, True)


def test_one_that_begins_on_the_ground_with_nothing_left_does_nothing() -> None:
    world = HeldCopter(ModelCopter(50.0))
    world.restart_agent()
    world.pass_time(3.0)
    assert world.sticks == []
    assert world.modes_asked() == []


def test_sticks_are_back_under_the_ground_stations_own_number() -> None:
    """ArduCopter 4.7 does not answer to the old name of the parameter: reading the new one takes three seconds."""
    copter = ModelCopter(50.0, height_m=20.0, mode=Mode.ALT_HOLD, parameters={"MAV_GCS_SYSID": 200.0})
    del copter.parameters["SYSID_MYGCS"]
    copter.has_position = False
    world = HeldCopter(copter, knows_s=0.0)
    copter.receiver = Receiver.CENTRED
    world.pass_time(5.0)
    world.take()
    world.pass_time(2.0)
    copter.receiver = Receiver.LOW
    height_m = copter.height_m
    world.restart_agent()
    world.pass_time(5.0)
    assert not sinks(world, height_m)


@pytest.mark.parametrize("receiver", list(Receiver))
def test_a_mode_of_sticks_that_is_commanded_before_the_autopilot_is_heard_comes_with_sticks(receiver: Receiver) -> None:
    world = HeldCopter(ModelCopter(50.0, receiver=receiver, height_m=40.0, mode=Mode.RTL), knows_s=1.1)
    world.restart_agent()
    world.link_up()
    world.pass_time(0.1)
    commanded_at, height_m = world.now, world.copter.height_m
    world.send(mode_command(Mode.ALT_HOLD))
    world.pass_time(3.0)
    assert world.copter.mode is Mode.ALT_HOLD
    assert world.longest_gap_s(commanded_at) <= 0.3
    assert not sinks(world, height_m)


@pytest.mark.parametrize("receiver", WITH_RECEIVER)
def test_a_drone_that_nobody_flies_is_counted_by_the_next_process_too(receiver: Receiver) -> None:
    world = flown(receiver, mode=Mode.GUIDED, hand=None)
    world.send(mode_command(Mode.GUIDED))
    world.pass_time(1.0)
    world.restart_agent()
    world.link_up(holder=None, present=False)
    world.sticks.clear()
    world.pass_time(3.0)
    assert (world.state.open, world.state.phase, world.sticks) == (False, LostPhase.COUNTING, [])
    world.pass_time(30.0)
    assert world.copter.mode is Mode.RTL
    world.pass_time(60.0)
    assert world.store.record is None, "it is on the ground"


def test_a_holder_who_is_there_after_the_restart_flies_on() -> None:
    world = flown(mode=Mode.GUIDED, hand=None)
    world.send(mode_command(Mode.GUIDED))
    world.pass_time(1.0)
    world.restart_agent()
    world.link_up()
    world.pass_time(40.0)
    assert (world.copter.mode, world.state.phase) == (Mode.GUIDED, LostPhase.QUIET)
