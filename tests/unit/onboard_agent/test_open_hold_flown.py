"""An open hold that nobody takes over, flown: the countdown, the return, and a lost position."""

from itertools import pairwise

import pytest
from held_flights import NO_FAILSAFE, STAYS_IN_GUIDED, flown, sinks, taken
from worlds.held_copter import mode_command
from worlds.model_copter import Mode, Receiver

from wire.open_holds import AfterSticks, HoldStage, Lost, LostAction, LostPhase

# An admin takes, then does nothing


@pytest.mark.parametrize(
    ("receiver", "parameters", "mode", "keeps_sticks", "after"),
    [
        # The sticks of the flight hide whether the transmitter is still received.
        (Receiver.LOW, {}, Mode.BRAKE, True, AfterSticks.UNKNOWN),
        (Receiver.CENTRED, {}, Mode.BRAKE, True, AfterSticks.UNKNOWN),
        (Receiver.LOW, STAYS_IN_GUIDED, Mode.GUIDED, False, AfterSticks.STAYS),
        (Receiver.LOW, NO_FAILSAFE, Mode.BRAKE, False, AfterSticks.STAYS),
        (Receiver.NONE, {}, Mode.BRAKE, True, AfterSticks.RETURNS),
        (Receiver.NONE, STAYS_IN_GUIDED, Mode.GUIDED, False, AfterSticks.STAYS),
        (Receiver.NONE, {"FS_OPTIONS": 29.0}, Mode.GUIDED, False, AfterSticks.STAYS),
        (Receiver.NONE, NO_FAILSAFE, Mode.BRAKE, False, AfterSticks.STAYS),
    ],
)
def test_stage_two_is_confirmed_and_then_sticks_stop_where_that_is_safe(
    receiver: Receiver, parameters: dict[str, float], mode: Mode, keeps_sticks: bool, after: AfterSticks
) -> None:
    world = flown(receiver, parameters=parameters)
    taken_at, height_m = world.now, world.copter.height_m
    world.take()
    world.pass_time(0.2)
    assert world.copter.mode is Mode.ALT_HOLD
    assert world.state.stage is HoldStage.ALTITUDE
    world.pass_time(3.8)
    assert (world.copter.mode, world.state.stage, world.state.mode) == (mode, HoldStage.STAY, mode.name)
    assert (world.state.sticks, world.state.after_sticks) == (keeps_sticks, after)
    world.sticks.clear()
    world.pass_time(20.0)
    assert bool(world.sticks) is keeps_sticks
    assert not keeps_sticks or world.longest_gap_s(world.now - 10.0) <= 0.3
    assert world.copter.mode is mode
    assert not sinks(world, height_m)
    assert world.steps() == ["sticks_centred", "mode_requested", "mode_acknowledged", "confirmed"]
    assert [change.why for change in world.copter.changes] == ["commanded"] * len(world.copter.changes)
    assert all((one.x, one.z) == (0, 500) for one in world.sticks_since(taken_at) if not one.buttons)


@pytest.mark.parametrize("receiver", list(Receiver))
def test_an_idle_person_is_counted_aloud_and_then_the_drone_returns(receiver: Receiver) -> None:
    world = flown(receiver)
    taken_at = world.now
    world.take()
    world.pass_time(29.9)
    reported = [(at - taken_at, one) for at, one in world.states() if at > taken_at + 0.1]
    assert {(one.lost, one.phase, one.action) for _, one in reported} == {
        (Lost.PERSON, LostPhase.COUNTING, LostAction.RETURN)
    }
    assert all(one.due_in_s == pytest.approx(30.0 - at, abs=0.1) for at, one in reported)
    times = [at for at, _ in reported] + [29.9]
    assert max(later - earlier for earlier, later in pairwise(times)) <= 5.1
    assert world.copter.mode is not Mode.RTL
    world.pass_time(0.3)
    assert world.copter.mode is Mode.RTL
    assert (world.state.phase, world.state.action, world.state.open) == (LostPhase.DONE, LostAction.RETURN, False)
    world.pass_time(40.0)
    assert not world.copter.armed, "it is at home"
    assert world.copter.touched_m_s == pytest.approx(0.5, abs=0.2)
    assert [change.why for change in world.copter.changes] == ["commanded"] * len(world.copter.changes)


def test_somebody_says_stay_and_the_battery_ends_it() -> None:
    world = taken(after_s=10.0)
    world.stay()
    world.pass_time(0.1)
    assert (world.state.phase, world.state.due_in_s) == (LostPhase.STAYED, None)
    height_m = world.copter.height_m
    world.copter.battery_percent = 80
    world.pass_time(120.0)
    assert (world.copter.mode, world.state.phase) == (Mode.BRAKE, LostPhase.STAYED)
    assert not sinks(world, height_m)
    assert "of its battery it goes home" in world.state.detail
    world.copter.battery_percent = 21
    world.pass_time(5.0)
    assert (world.copter.mode, world.state.phase) == (Mode.BRAKE, LostPhase.COUNTING)
    world.pass_time(6.5)
    assert world.copter.mode is Mode.RTL
    assert world.state.phase is LostPhase.DONE


def test_stay_without_a_count_says_nothing() -> None:
    world = flown()
    world.stay()
    world.take()
    world.pass_time(31.0)
    assert world.copter.mode is Mode.RTL


def test_the_next_hold_counts_anew_after_a_stay() -> None:
    world = taken()
    world.stay()
    world.pass_time(60.0)
    world.take()
    world.pass_time(0.1)
    assert world.state.phase is LostPhase.COUNTING
    assert world.state.due_in_s == pytest.approx(29.9, abs=0.1)


@pytest.mark.parametrize("action", [LostAction.STAY, LostAction.CONTINUE])
def test_staying_may_be_what_was_chosen(action: LostAction) -> None:
    world = taken(lost_action=action, after_s=100.0)
    assert (world.copter.mode, world.state.phase, world.state.open) == (Mode.BRAKE, LostPhase.STAYED, True)
    assert not sinks(world, 20.0)


def test_an_order_that_is_repeated_on_a_new_link_changes_nothing() -> None:
    world = taken()
    world.stay()
    world.pass_time(20.0)
    world.link_down()
    world.pass_time(1.0)
    world.link_up()
    changes, orders = len(world.copter.changes), world.order_again()
    world.pass_time(3.0)
    assert len(world.copter.changes) == changes
    assert (world.state.stage, world.state.phase, world.state.open) == (HoldStage.STAY, LostPhase.STAYED, True)
    assert (world.progress()[-1].order_id, world.progress()[-1].step) == (orders, "confirmed")


# Without a position


@pytest.mark.parametrize("receiver", list(Receiver))
def test_without_a_position_sticks_keep_the_height_and_it_lands_announced(receiver: Receiver) -> None:
    world = flown(receiver, mode=Mode.ALT_HOLD)
    world.copter.has_position = False
    world.pass_time(2.0)
    height_m, taken_at = world.copter.height_m, world.now
    world.take()
    world.pass_time(29.0)
    assert world.copter.mode is Mode.ALT_HOLD
    assert (world.state.stage, world.state.waiting_for) == (HoldStage.ALTITUDE, "no position")
    assert (world.state.sticks, world.state.action) == (True, LostAction.LAND)
    assert world.longest_gap_s(taken_at) <= 0.3
    assert not sinks(world, height_m)
    world.pass_time(1.5)
    assert world.copter.mode is Mode.LAND
    assert (world.state.phase, world.state.action) == (LostPhase.DONE, LostAction.LAND)
    world.pass_time(60.0)
    assert not world.copter.armed
    assert [change.why for change in world.copter.changes] == ["commanded"] * len(world.copter.changes)


@pytest.mark.parametrize("after_s", [0.0, 0.5], ids=lambda s: f"{s} s after a report")
@pytest.mark.parametrize("receiver", list(Receiver))
def test_a_position_that_is_lost_in_stage_two_leads_back_to_stage_one_before_the_autopilot_lands(
    receiver: Receiver, after_s: float
) -> None:
    """One second after the report from its estimator, ArduCopter lands by itself."""
    world = taken(receiver)
    reported_at = world.copter.estimator_reported_at
    world.pass_until(lambda: world.copter.estimator_reported_at > reported_at)
    world.pass_time(after_s)
    height_m = world.copter.height_m
    world.copter.has_position = False
    lost_at = world.now
    world.pass_time(1.0)
    assert world.copter.mode is Mode.ALT_HOLD
    world.pass_time(12.0)
    assert world.copter.mode is Mode.ALT_HOLD
    assert (world.state.stage, world.state.sticks) == (HoldStage.ALTITUDE, True)
    assert world.longest_gap_s(lost_at + 1.0) <= 0.3
    assert not sinks(world, height_m)
    assert "EKF failsafe" not in {change.why for change in world.copter.changes}


@pytest.mark.parametrize("kept_for_the_holder", [True, False])
@pytest.mark.parametrize("receiver", list(Receiver))
def test_a_position_that_is_lost_in_a_rung_that_needs_one_leads_to_altitude_hold(
    receiver: Receiver, kept_for_the_holder: bool
) -> None:
    world = flown(receiver, hold_ladder=("LOITER",))
    if kept_for_the_holder:
        world.take()
        world.pass_time(3.0)
        world.send(mode_command(Mode.LOITER))
    else:
        world.copter.refuses = frozenset({Mode.BRAKE, Mode.GUIDED})
        world.take()
    world.pass_time(2.0)
    assert world.copter.mode is Mode.LOITER
    height_m = world.copter.height_m
    world.copter.has_position = False
    world.pass_time(4.0)
    assert world.copter.mode is Mode.ALT_HOLD
    assert "EKF failsafe" not in {change.why for change in world.copter.changes}
    assert not sinks(world, height_m)


def test_a_position_that_is_back_leads_to_stage_two_again() -> None:
    world = taken()
    world.copter.has_position = False
    world.pass_time(5.0)
    world.copter.has_position = True
    world.pass_time(8.0)
    assert (world.copter.mode, world.state.stage) == (Mode.BRAKE, HoldStage.STAY)
