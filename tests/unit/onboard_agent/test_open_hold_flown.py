"""An open hold from its order to its end, with a model ArduCopter beside the whole agent: what flies, what is told.

By receiver and parameters; most begin in the air with a hand on the sticks.
"""

from itertools import pairwise
from typing import Any

import pytest
from worlds.held_copter import ARM, HeldCopter, go_to, mode_command, takeoff
from worlds.model_copter import Mode, ModelCopter, Receiver

from wire.control_messages import HoldStep
from wire.dialect import mavlink
from wire.open_holds import AfterSticks, HoldStage, Lost, LostAction, LostPhase

STEP_S = 0.05
STAYS_IN_GUIDED = {"FS_OPTIONS": 20.0}
NO_FAILSAFE = {"FS_THR_ENABLE": 0.0}


def flown(
    receiver: Receiver = Receiver.LOW,
    *,
    parameters: dict[str, float] | None = None,
    mode: Mode = Mode.LOITER,
    hand: tuple[int, int] | None = (600, 500),
    height_m: float = 20.0,
    **settings: Any,
) -> HeldCopter:
    """Somebody flies; the agent has read what it wants to know."""
    copter = ModelCopter(50.0, receiver=receiver, parameters=parameters, height_m=height_m, mode=mode)
    world = HeldCopter(copter, step_s=STEP_S, knows_s=0.0, **settings)
    world.hand = hand
    world.pass_time(3.0)
    return world


def taken(receiver: Receiver = Receiver.LOW, *, after_s: float = 5.0, **how: Any) -> HeldCopter:
    world = flown(receiver, **how)
    world.take()
    world.pass_time(after_s)
    return world


def sinks(world: HeldCopter, height_m: float) -> bool:
    return world.copter.height_m < height_m - 1.0


# Who takes and then does nothing


@pytest.mark.parametrize(
    ("receiver", "parameters", "mode", "keeps_sticks", "after"),
    [
        (Receiver.LOW, {}, Mode.BRAKE, False, AfterSticks.STAYS),
        (Receiver.CENTRED, {}, Mode.BRAKE, False, AfterSticks.STAYS),
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
    told = [(at - taken_at, one) for at, one in world.states() if at > taken_at + 0.1]
    assert {(one.lost, one.phase, one.action) for _, one in told} == {
        (Lost.PERSON, LostPhase.COUNTING, LostAction.RETURN)
    }
    assert all(one.due_in_s == pytest.approx(30.0 - at, abs=0.1) for at, one in told)
    times = [at for at, _ in told] + [29.9]
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
    """One second after its estimator has told, ArduCopter lands by itself."""
    world = taken(receiver)
    reported_at = world.copter.estimator_told_at
    world.pass_until(lambda: world.copter.estimator_told_at > reported_at)
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


# In a return or a landing


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
    """The last heartbeat is older than the order, and than what the holder has commanded."""
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
    """Somebody's sticks came until just now: without a receiver they must not simply end."""
    world = flown(receiver)
    world.send(mode_command(Mode.RTL))
    world.hand = None
    world.pass_time(0.3)
    world.take(interrupts=False)
    world.pass_time(40.0)
    assert [change.why for change in world.copter.changes] == ["commanded"]
    assert not world.copter.armed


# By whom a hold is ended


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
    """The sticks that were kept for the autopilot are nobody's hand."""
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


# Out of what flies without sticks


@pytest.mark.parametrize("parameters", [{}, STAYS_IN_GUIDED, NO_FAILSAFE])
@pytest.mark.parametrize("receiver", list(Receiver))
def test_a_hold_of_what_goes_to_a_place_stops_it(receiver: Receiver, parameters: dict[str, float]) -> None:
    """GUIDED again would be accepted at once, and it would fly on."""
    world = flown(receiver, parameters=parameters, mode=Mode.GUIDED, hand=None)
    world.send(go_to())
    world.pass_time(5.0)
    assert world.copter.speed_m_s == pytest.approx(5.0)
    world.take()
    world.pass_time(6.0)
    assert world.copter.speed_m_s < 0.5
    assert (world.state.open, world.state.stage) == (True, HoldStage.STAY)


@pytest.mark.parametrize("parameters", [{}, STAYS_IN_GUIDED])
@pytest.mark.parametrize("at_m", [0.2, 1.5, 6.0])
@pytest.mark.parametrize("receiver", [Receiver.LOW, Receiver.NONE])
def test_a_hold_in_a_guided_take_off_stops_the_climb(
    receiver: Receiver, at_m: float, parameters: dict[str, float]
) -> None:
    world = HeldCopter(ModelCopter(50.0, receiver=receiver, parameters=parameters, mode=Mode.GUIDED), step_s=STEP_S)
    world.send(ARM, takeoff(40.0))
    world.pass_until(lambda: world.copter.height_m >= at_m)
    world.take()
    world.pass_time(10.0)
    assert world.copter.height_m < at_m + 5.0
    assert abs(world.copter.climb_m_s) < 0.3
    assert world.state.open


@pytest.mark.parametrize("receiver", list(Receiver))
def test_a_hold_of_a_mission_stops_it_and_keeps_the_height(receiver: Receiver) -> None:
    world = flown(receiver, mode=Mode.AUTO, hand=None)
    world.take()
    world.pass_time(6.0)
    assert world.copter.mode is Mode.BRAKE
    assert world.copter.speed_m_s < 0.5
    assert not sinks(world, 20.0)


# Who is lost


@pytest.mark.parametrize("receiver", list(Receiver))
def test_a_browser_that_is_gone_is_held_counted_and_brought_home(receiver: Receiver) -> None:
    world = flown(receiver, hand=(800, 1000))
    world.hand = None
    gone_at = world.now
    world.holder_is(present=False)
    world.pass_time(0.7)
    assert world.copter.mode is Mode.ALT_HOLD
    assert world.longest_gap_s(gone_at) <= 0.6
    world.pass_time(31.0)
    assert world.copter.mode is Mode.RTL
    assert [one.action for _, one in world.states() if one.phase is LostPhase.COUNTING][-1] is LostAction.RETURN


@pytest.mark.parametrize("receiver", list(Receiver))
def test_a_tower_that_is_gone_in_a_hold_leaves_it_open(receiver: Receiver) -> None:
    world = taken(receiver)
    height_m = world.copter.height_m
    world.link_down()
    world.pass_time(20.0)
    assert world.copter.mode is Mode.BRAKE
    assert not sinks(world, height_m)
    world.link_up()
    world.pass_time(0.1)
    assert (world.state.open, world.state.stage) == (True, HoldStage.STAY)


def test_somebody_whose_drone_flies_by_itself_is_counted_from_their_going() -> None:
    world = flown(hand=None, mode=Mode.AUTO)
    world.holder_is(present=False)
    world.pass_time(10.0)
    assert (world.state.lost, world.state.phase) == (Lost.PERSON, LostPhase.COUNTING)
    assert not world.state.open
    world.holder_is(present=True)
    world.pass_time(0.1)
    assert world.state.phase is LostPhase.QUIET


# Slow links


def test_sticks_that_are_too_old_for_too_long_hold() -> None:
    world = flown(hand=(800, 500))
    world.slow_tower_s = 0.4
    late_at = world.now
    world.pass_time(0.8)  # of the second 0.15 s were over when they came
    assert world.copter.mode is Mode.LOITER
    world.pass_time(0.4)
    assert world.copter.mode is Mode.ALT_HOLD
    assert world.copter.changes[0].at - late_at <= 1.2
    assert "late" in world.progress()[0].detail


def test_sticks_that_are_old_for_a_moment_hold_nothing() -> None:
    world = flown(hand=(800, 500))
    for _ in range(5):
        world.slow_tower_s = 0.4
        world.pass_time(0.7)
        world.slow_tower_s = 0.0
        world.pass_time(0.3)
    assert world.copter.changes == []


# Near the ground


@pytest.mark.parametrize("receiver", list(Receiver))
def test_near_the_ground_and_sinking_stage_one_climbs_first(receiver: Receiver) -> None:
    world = flown(receiver, height_m=12.0, hand=(0, 0))
    world.pass_until(lambda: world.copter.height_m <= 4.0)
    world.take()
    low_m, taken_at = world.copter.height_m, world.now
    for _ in range(200):
        world.pass_time(STEP_S)
        low_m = min(low_m, world.copter.height_m)
    assert low_m > 1.0
    assert world.copter.touched_m_s is None
    own = [one.z for one in world.sticks_since(taken_at) if not one.buttons]
    assert (own[0], own[-1]) == (1000, 500)
    assert world.copter.height_m < 6.0, "it climbs no longer than it sinks"


# What is told


@pytest.mark.parametrize("loses", [True, False])
def test_lost_or_slow_answers_delay_it_and_no_more(loses: bool) -> None:
    world = flown()
    height_m = world.copter.height_m
    world.copter.loses_acks, world.copter.ack_after_s = loses, 0.4
    world.take()
    world.pass_time(5.0)
    assert not sinks(world, height_m)
    assert world.longest_gap_s(world.now - 1.0) <= 0.3 or world.copter.mode is Mode.BRAKE
    world.copter.loses_acks, world.copter.ack_after_s = False, 0.003
    world.pass_time(10.0)
    assert world.copter.mode in (Mode.BRAKE, Mode.GUIDED)
    assert world.state.stage is HoldStage.STAY
    assert HoldStep.CONFIRMED in world.steps()


def test_a_new_link_is_told_of_it_first() -> None:
    world = taken()
    world.link_down()
    world.pass_time(5.0)
    told = len(world.states())
    world.link_up()
    world.pass_time(0.1)
    new = [one for _, one in world.states()[told:]]
    assert new[0].open
    assert [one.number for _, one in world.states()] == sorted({one.number for _, one in world.states()})


def test_a_tower_that_does_not_take_it_is_told_none() -> None:
    world = flown()
    world.link_down()
    world.link_up(takes=())
    world.told.clear()
    world.take()
    world.pass_time(5.0)
    assert world.states() == []
    assert "confirmed" in world.steps()


def test_no_ground_station_heartbeat_hides_the_loss_of_the_tower() -> None:
    world = taken(Receiver.NONE)
    world.link_down()
    world.pass_time(3.0)
    world.agent_sent.clear()
    beats: list[Any] = []
    world.pass_time(3.0)
    beats += [one for one in world.agent_sent if one.get_type() == "HEARTBEAT"]
    assert {one.type for one in beats} == {mavlink.MAV_TYPE_ONBOARD_CONTROLLER}
