"""Conditions in which a hold begins, flown: no sticks, lost browsers and towers, slow links, near the ground."""

from typing import Any

import pytest
from held_flights import NO_FAILSAFE, STAYS_IN_GUIDED, STEP_S, flown, sinks, taken
from worlds.held_copter import ARM, HeldCopter, go_to, mode_command, takeoff
from worlds.model_copter import USES_STICKS, Mode, ModelCopter, Receiver

from wire.control_messages import ControlChanged, HoldStep
from wire.dialect import mavlink
from wire.open_holds import HoldStage, Lost, LostAction, LostPhase

# Modes that need a hand, commanded where there is none


@pytest.mark.parametrize("receiver", list(Receiver))
@pytest.mark.parametrize("mode", sorted(USES_STICKS))
def test_no_mode_that_needs_a_hand_sinks_without_one(mode: Mode, receiver: Receiver) -> None:
    """CIRCLE flies its way by itself, and takes its height from the throttle of a radio at rest."""
    world = flown(receiver, mode=Mode.GUIDED, hand=None)
    world.send(mode_command(mode))
    world.pass_until(lambda: world.state.phase is LostPhase.COUNTING, within_s=5.0)
    height_m = world.copter.height_m
    world.pass_until(lambda: world.state.phase is LostPhase.DONE, within_s=40.0)
    assert not sinks(world, height_m)
    assert world.copter.mode is Mode.RTL
    assert [change.why for change in world.copter.changes] == ["commanded"] * len(world.copter.changes)


@pytest.mark.parametrize("mode", sorted(USES_STICKS))
def test_a_hand_that_goes_away_ends_in_a_hold_in_every_mode_that_needs_one(mode: Mode) -> None:
    world = flown(mode=mode)
    world.hand = None
    world.pass_time(8.0)
    assert world.state.open
    assert world.copter.mode in (Mode.BRAKE, Mode.GUIDED)
    assert world.copter.height_m > 18.0


# Nobody has the controls


def released(world: HeldCopter) -> None:
    world.epoch += 1
    world.message(ControlChanged(epoch=world.epoch, holder=None, holder_present=False))


def test_what_hovers_without_anybody_comes_home() -> None:
    world = flown(mode=Mode.GUIDED, hand=None)
    world.send(go_to())
    released(world)
    world.pass_time(1.0)
    assert (world.state.lost, world.state.phase, world.state.action) == (
        Lost.PERSON,
        LostPhase.COUNTING,
        LostAction.RETURN,
    )
    world.pass_time(28.0)
    assert world.copter.mode is Mode.GUIDED
    world.pass_time(6.0)
    assert world.copter.mode is Mode.RTL
    assert (world.state.lost, world.state.phase, world.state.action) == (
        Lost.PERSON,
        LostPhase.DONE,
        LostAction.RETURN,
    ), "people are told why it returns, for as long as it does"
    world.pass_time(60.0)
    assert not world.copter.armed
    assert world.state.phase is LostPhase.QUIET


def test_a_return_that_was_commanded_before_the_release_is_no_loss() -> None:
    world = flown(mode=Mode.GUIDED, hand=None)
    world.send(mode_command(Mode.RTL))
    world.pass_time(2.0)
    released(world)
    world.pass_time(10.0)
    assert world.copter.mode is Mode.RTL
    assert world.state.phase is LostPhase.QUIET


def test_a_mission_without_anybody_goes_on() -> None:
    world = flown(mode=Mode.GUIDED, hand=None)
    world.send(mode_command(Mode.AUTO))
    world.pass_time(2.0)
    released(world)
    world.pass_time(60.0)
    assert world.copter.mode is Mode.AUTO
    assert world.state.phase is LostPhase.QUIET


@pytest.mark.parametrize(
    ("lost_action", "ends_in"),
    [(LostAction.RETURN, Mode.RTL), (LostAction.LAND, Mode.LAND), (LostAction.CONTINUE, Mode.AUTO)],
)
def test_a_mission_that_is_over_leaves_a_drone_in_the_air_with_nobody(lost_action: LostAction, ends_in: Mode) -> None:
    world = flown(mode=Mode.GUIDED, hand=None, lost_action=lost_action)
    world.send(mode_command(Mode.AUTO))
    world.pass_time(2.0)
    released(world)
    world.pass_time(40.0)
    assert world.state.phase is LostPhase.QUIET
    world.copter.mission_state = mavlink.MISSION_STATE_COMPLETE
    world.pass_time(2.0)
    assert (world.state.lost, world.state.phase) == (Lost.PERSON, LostPhase.COUNTING)
    world.pass_time(32.0)
    assert world.copter.mode is ends_in
    if lost_action is LostAction.CONTINUE:
        assert world.state.phase is LostPhase.STAYED, "there is nothing to go on with"


def test_a_mission_that_is_started_anew_flies_alone_again() -> None:
    world = flown(mode=Mode.GUIDED, hand=None)
    world.send(mode_command(Mode.AUTO))
    world.copter.mission_state = mavlink.MISSION_STATE_COMPLETE
    released(world)
    world.pass_time(5.0)
    assert world.state.phase is LostPhase.COUNTING
    world.copter.mission_state = mavlink.MISSION_STATE_ACTIVE
    world.pass_time(2.0)
    assert world.state.phase is LostPhase.QUIET


def test_a_transmitter_flies_alone() -> None:
    world = flown(Receiver.CENTRED, mode=Mode.GUIDED, hand=None)
    released(world)
    world.pass_time(60.0)
    assert world.copter.mode is Mode.GUIDED, "the tower has no part in this flight"


# On the ground


@pytest.mark.parametrize("receiver", [Receiver.LOW, Receiver.NONE])
def test_motors_of_a_drone_that_nobody_attends_stop(receiver: Receiver) -> None:
    """With centred sticks DISARM_DELAY never comes."""
    copter = ModelCopter(50.0, receiver=receiver)
    world = HeldCopter(copter, step_s=STEP_S)
    world.send(mode_command(Mode.ALT_HOLD))
    world.send(ARM)
    world.hand = (0, 500)
    world.pass_time(2.0)
    assert copter.armed
    world.take()
    world.pass_time(2.0)
    assert copter.armed, "it may be taking off"
    world.pass_time(12.0)
    assert not copter.armed
    assert not world.state.open
    assert copter.height_m == 0.0


# From modes that fly without sticks


@pytest.mark.parametrize("parameters", [{}, STAYS_IN_GUIDED, NO_FAILSAFE])
@pytest.mark.parametrize("receiver", list(Receiver))
def test_a_hold_of_what_goes_to_a_place_stops_it(receiver: Receiver, parameters: dict[str, float]) -> None:
    """The autopilot would accept GUIDED again at once and fly on."""
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


# Losses


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


@pytest.mark.parametrize("link_breaks", [False, True])
def test_last_sticks_just_before_a_mode_that_needs_them_are_held(link_breaks: bool) -> None:
    """Nothing came after the command, so nothing could go stale, and the drone sank on the radio's throttle."""
    world = flown(hand=(0, 500))
    world.hand = None
    world.send(mode_command(Mode.RTL))
    world.pass_time(2 * STEP_S)
    assert world.copter.mode is Mode.RTL
    world.send(mode_command(Mode.LOITER))
    if link_breaks:
        world.link_down()
    world.pass_time(0.8)
    assert world.agent.hold.open
    world.pass_time(5.0)
    assert world.copter.mode is Mode.BRAKE
    assert not sinks(world, 20.0)


def test_a_go_to_that_is_refused_in_a_mode_not_yet_seen_does_not_end_the_watch() -> None:
    """The agent took the go-to for a flight without sticks, because it still saw the return."""
    world = flown(hand=(0, 500))
    world.send(mode_command(Mode.RTL))
    world.pass_time(0.5)
    world.copter.ack_after_s = 0.3
    world.send(mode_command(Mode.LOITER))
    world.pass_time(0.2)
    world.send(go_to())
    world.hand = None
    world.pass_time(1.2)
    assert world.agent.hold.open
    assert not sinks(world, 20.0)


def test_a_return_of_the_agents_that_a_person_ends_without_sticks_is_not_the_last_word() -> None:
    """The lost action counted as done for good: it ended the centred sticks at once, and no countdown followed."""
    world = flown(hand=(0, 500), lost_action_s=8.0)
    world.hand = None
    world.pass_until(lambda: world.state.phase is LostPhase.DONE)
    world.send(mode_command(Mode.LOITER))
    height_m = world.copter.height_m
    world.pass_time(4.0)
    assert world.copter.mode is Mode.LOITER
    assert not sinks(world, height_m)
    assert (world.state.open, world.state.phase) == (True, LostPhase.COUNTING)
    world.pass_time(5.0)
    assert world.copter.mode is Mode.RTL


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
    world.pass_time(0.8)  # 0.15 s of the second had passed on arrival
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


# Reports


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
    reported = len(world.states())
    world.link_up()
    world.pass_time(0.1)
    new = [one for _, one in world.states()[reported:]]
    assert new[0].open
    assert [one.number for _, one in world.states()] == sorted({one.number for _, one in world.states()})


def test_a_tower_that_does_not_take_it_is_told_none() -> None:
    world = flown()
    world.link_down()
    world.link_up(takes=())
    world.reported.clear()
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
