"""What ends a hold, flown: pilots, commands, radio switches, disarming; returns and landings go on."""

import pytest
from held_flights import STAYS_IN_GUIDED, flown, sinks, taken
from worlds.held_copter import go_to, mode_command
from worlds.model_copter import Mode, Receiver

from wire.open_holds import HoldStage, LostPhase

# During a return or a landing


@pytest.mark.parametrize("mode", [Mode.RTL, Mode.LAND])
def test_a_return_or_landing_goes_on_unless_the_order_interrupts(mode: Mode) -> None:
    world = flown()
    world.send(mode_command(mode))
    world.hand = None
    world.pass_time(1.0)
    world.take(interrupts=False)
    world.pass_time(3.0)
    assert world.copter.mode is mode
    assert world.steps() == ["not_needed"]
    assert mode.name in world.progress()[-1].detail
    assert not world.state.open
    world.take()
    world.pass_time(4.0)
    assert world.copter.mode is Mode.BRAKE
    assert world.state.open


@pytest.mark.parametrize("slow_s", [0.003, 0.15, 0.3])
@pytest.mark.parametrize("mode", [Mode.RTL, Mode.LAND])
@pytest.mark.parametrize("receiver", list(Receiver))
def test_a_landing_that_was_just_interrupted_is_none(receiver: Receiver, mode: Mode, slow_s: float) -> None:
    """The last heartbeat is older than the order and the holder's command."""
    world = flown(receiver, hand=None, mode=mode, height_m=30.0)
    world.copter.ack_after_s = slow_s
    height_m = world.copter.height_m
    world.send(mode_command(Mode.ALT_HOLD))
    commanded_at = world.now
    world.pass_time(0.1)
    world.take(interrupts=False)
    world.pass_time(8.0)
    assert world.state.open
    assert not sinks(world, height_m - 1.0)
    stopped = next(change.at for change in world.copter.changes if change.mode is Mode.BRAKE)
    assert world.longest_gap_s(commanded_at, stopped) <= 0.5


@pytest.mark.parametrize("receiver", list(Receiver))
def test_a_return_that_is_not_interrupted_is_not_begun_anew_by_a_radio_failsafe(receiver: Receiver) -> None:
    """Sticks arrived until just now: without a receiver they must not simply end."""
    world = flown(receiver)
    world.send(mode_command(Mode.RTL))
    world.hand = None
    world.pass_time(0.3)
    world.take(interrupts=False)
    world.pass_time(40.0)
    assert [change.why for change in world.copter.changes] == ["commanded"]
    assert not world.copter.armed


# Ways to end a hold


@pytest.mark.parametrize("receiver", list(Receiver))
def test_a_pilot_takes_up_the_sticks_after_stage_two_and_flies_in_the_mode_of_before(receiver: Receiver) -> None:
    world = taken(receiver)
    assert world.copter.mode is Mode.BRAKE
    at = world.now
    world.hand = (0, 500)
    world.pass_time(0.5)
    world.hand = (500, 500)
    world.pass_time(5.0)
    assert world.copter.mode is Mode.LOITER
    assert (world.state.open, world.state.phase) == (False, LostPhase.QUIET)
    assert world.longest_gap_s(at) <= 0.3
    assert world.sticks[-1].x == 500
    assert [change.why for change in world.copter.changes] == ["commanded"] * len(world.copter.changes)
    world.pass_time(40.0)
    assert world.copter.mode is Mode.LOITER, "and nothing is counted any more"


def test_sticks_that_are_not_centred_do_not_end_it() -> None:
    world = taken()
    world.hand = (500, 500)
    world.pass_time(10.0)
    assert world.copter.mode is Mode.BRAKE
    assert world.state.open
    world.pass_time(20.0)
    assert world.copter.mode is Mode.RTL, "and nobody flies"


def test_a_mode_that_uses_sticks_comes_with_the_agents_centred_ones() -> None:
    world = taken()
    height_m = world.copter.height_m
    world.sticks.clear()
    at = world.now
    world.send(mode_command(Mode.LOITER))
    world.pass_time(2.0)
    assert world.copter.mode is Mode.LOITER
    assert world.longest_gap_s(at) <= 0.3
    assert {(one.x, one.z, one.buttons) for one in world.sticks} == {(0, 500, 0)}
    assert not sinks(world, height_m)
    world.pass_time(50.0)
    assert world.copter.mode is Mode.RTL, "nobody took up the sticks"


@pytest.mark.parametrize("receiver", list(Receiver))
def test_who_changes_their_mind_at_once_is_given_sticks(receiver: Receiver) -> None:
    world = flown(receiver)
    world.take()
    world.pass_time(0.1)
    height_m = world.copter.height_m
    world.send(mode_command(Mode.RTL))
    world.pass_time(0.1)
    world.send(mode_command(Mode.LOITER))
    commanded_at = world.now
    world.pass_time(5.0)
    assert world.longest_gap_s(commanded_at) <= 0.3
    assert not sinks(world, height_m)


@pytest.mark.parametrize("mode", [Mode.LOITER, Mode.ALT_HOLD])
def test_without_a_receiver_a_mode_of_sticks_out_of_one_that_was_kept_is_given_sticks_too(mode: Mode) -> None:
    """Sticks kept for the autopilot do not count as a pilot's."""
    world = flown(Receiver.NONE)
    world.hand = None
    world.send(mode_command(Mode.GUIDED))
    world.pass_time(5.0)
    commanded_at = world.now
    world.send(mode_command(mode))
    world.pass_time(3.0)
    assert world.longest_gap_s(commanded_at) <= 0.3
    assert world.copter.mode is mode


@pytest.mark.parametrize("receiver", list(Receiver))
def test_a_command_that_is_refused_does_not_end_it(receiver: Receiver) -> None:
    world = taken(receiver)
    assert world.copter.mode is Mode.BRAKE
    world.send(go_to())
    world.pass_time(3.0)
    assert (world.copter.mode, world.state.open, world.state.stage) == (Mode.BRAKE, True, HoldStage.STAY)
    assert world.state.phase is LostPhase.COUNTING


@pytest.mark.parametrize("mode", [Mode.RTL, Mode.LAND, Mode.AUTO, Mode.GUIDED])
def test_a_command_that_the_autopilot_shows_ends_it(mode: Mode) -> None:
    world = taken()
    world.send(mode_command(mode))
    world.pass_time(1.0)
    assert (world.copter.mode, world.state.open, world.state.phase) == (mode, False, LostPhase.QUIET)
    world.sticks.clear()
    world.pass_time(3.0)
    assert not world.sticks
    assert world.copter.mode is mode


def test_a_go_to_in_a_guided_hold_ends_it() -> None:
    world = taken(Receiver.NONE, parameters=STAYS_IN_GUIDED)
    assert world.copter.mode is Mode.GUIDED
    world.send(go_to())
    world.pass_time(1.0)
    assert (world.state.open, world.state.phase) == (False, LostPhase.QUIET)


def test_a_radio_pilots_switch_ends_it_and_without_a_receiver_nobody_can_have_one() -> None:
    for receiver in (Receiver.CENTRED, Receiver.NONE):
        world = taken(receiver)
        world.copter.switch(Mode.LOITER)
        world.pass_time(5.0)
        if receiver is Receiver.NONE:
            assert (world.copter.mode, world.state.open) == (Mode.BRAKE, True), "another ground station: held again"
            continue
        assert (world.copter.mode, world.state.open, world.state.phase) == (Mode.LOITER, False, LostPhase.QUIET)
        world.sticks.clear()
        world.pass_time(5.0)
        assert world.sticks == []


def test_disarming_ends_it() -> None:
    world = taken(height_m=0.5)
    world.copter.height_m = world.copter.climb_m_s = 0.0
    world.copter.armed = False
    world.pass_time(2.0)
    assert (world.state.open, world.state.phase) == (False, LostPhase.QUIET)
    world.sticks.clear()
    world.pass_time(2.0)
    assert world.sticks == []
