"""A hold on a drone with a receiver: its transmitter is lost, works, or is switched on to save it (docs/agent.md)."""

from itertools import pairwise

import pytest
from held_flights import STAYS_IN_GUIDED, flown, sinks, taken
from worlds.held_copter import HeldCopter
from worlds.model_copter import Mode, Receiver

from wire.control_messages import HoldCause
from wire.open_holds import AfterSticks, HoldStage

WITH_RECEIVER = [Receiver.LOW, Receiver.CENTRED]


def whys(world: HeldCopter) -> set[str]:
    return {change.why for change in world.copter.changes}


@pytest.mark.parametrize("receiver", WITH_RECEIVER)
@pytest.mark.parametrize("failsafe", [0.0, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("lost_in_hold", [False, True])
def test_a_lost_transmitter_does_not_take_the_drone_out_of_its_hold(
    receiver: Receiver, failsafe: float, lost_in_hold: bool
) -> None:
    world = flown(receiver, parameters={"FS_THR_ENABLE": failsafe})
    world.copter.transmitter_lost = not lost_in_hold
    world.pass_time(2.0)
    height_m = world.copter.height_m
    world.take()
    world.pass_time(5.0)
    world.copter.transmitter_lost = True
    world.pass_time(20.0)
    assert (world.copter.mode, world.state.stage) == (Mode.BRAKE, HoldStage.STAY)
    assert whys(world) == {"commanded"}
    assert not sinks(world, height_m)
    if failsafe:
        assert (world.state.sticks, world.state.after_sticks) == (True, AfterSticks.UNKNOWN)
        assert world.longest_gap_s(world.now - 15.0) <= 0.3


@pytest.mark.parametrize("lost", [False, True])
def test_a_mode_that_the_autopilot_keeps_either_way_needs_no_sticks(lost: bool) -> None:
    world = flown(parameters=STAYS_IN_GUIDED)
    world.copter.transmitter_lost = lost
    world.take()
    world.pass_time(5.0)
    assert (world.state.sticks, world.state.after_sticks) == (False, AfterSticks.STAYS)
    world.sticks.clear()
    world.pass_time(20.0)
    assert (world.copter.mode, world.sticks) == (Mode.GUIDED, [])


def test_a_hold_out_of_a_flight_without_sticks_begins_none() -> None:
    world = flown(mode=Mode.GUIDED, hand=None)
    world.take()
    world.pass_time(20.0)
    assert (world.state.stage, world.state.after_sticks, world.sticks) == (HoldStage.STAY, AfterSticks.STAYS, [])


@pytest.mark.parametrize(
    ("mode", "has_position"),
    [(Mode.STABILIZE, True), (Mode.ALT_HOLD, True), (Mode.LOITER, True), (Mode.STABILIZE, False)],
)
def test_who_takes_the_drone_out_of_a_hold_by_transmitter_flies_it_at_once(mode: Mode, has_position: bool) -> None:
    world = flown(mode=Mode.ALT_HOLD)
    world.copter.has_position = has_position
    world.pass_time(1.0)
    world.take()
    world.pass_time(6.0)
    assert world.copter.overridden
    world.copter.turn_switch(mode)
    world.pass_time(0.8)
    assert not world.copter.overridden
    assert world.copter.throttle == 0, "the transmitter's"
    assert not world.state.open
    world.pass_time(10.0)
    assert world.copter.changes[-1].why == "switched"
    assert not world.copter.overridden


@pytest.mark.parametrize("has_position", [True, False])
def test_a_transmitter_that_is_switched_on_to_save_the_drone_wins(has_position: bool) -> None:
    """It was off when the agent could last see that."""
    world = flown(mode=Mode.GUIDED, hand=None, parameters=STAYS_IN_GUIDED)
    world.copter.transmitter_lost = True
    world.pass_time(5.0)
    world.take()
    world.pass_time(1.0)
    world.copter.has_position = has_position
    world.pass_time(5.0)
    assert world.copter.overridden is not has_position
    world.copter.turn_switch(Mode.STABILIZE)
    world.pass_time(10.0)
    assert (world.copter.mode, world.copter.changes[-1].why) == (Mode.STABILIZE, "switched")
    assert not world.state.open


def test_another_ground_station_is_no_transmitter() -> None:
    world = flown(mode=Mode.GUIDED, hand=None, parameters=STAYS_IN_GUIDED)
    world.copter.transmitter_lost = True
    world.pass_time(5.0)
    world.take()
    world.pass_time(5.0)
    world.copter.switch(Mode.LOITER)
    world.pass_time(2.0)
    assert world.state.open
    assert world.progress()[-1].cause is HoldCause.PILOT_LOST


def test_the_autopilots_own_watch_for_a_ground_station_does_not_end_a_hold() -> None:
    world = taken(parameters={"FS_GCS_ENABLE": 1.0})
    world.link_down()
    world.sticks.clear()
    world.beats.clear()
    world.pass_time(20.0)
    assert world.longest_gap_s(world.now - 20.0) <= 0.3
    assert max(b - a for a, b in pairwise([world.now - 20.0, *world.beats, world.now])) <= 1.1
    assert world.copter.mode is Mode.BRAKE


@pytest.mark.parametrize(("lost", "mode"), [(True, Mode.RTL), (False, Mode.BRAKE)])
def test_when_the_agent_dies_the_autopilots_own_failsafe_acts(lost: bool, mode: Mode) -> None:
    world = taken()
    world.copter.transmitter_lost = lost
    world.pass_time(3.0)
    world.kill_agent()
    world.pass_time(2.0)
    assert world.copter.mode is mode
