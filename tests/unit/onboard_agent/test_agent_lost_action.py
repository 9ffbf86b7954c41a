"""The action when tower or person stays lost: each rule of `onboard_agent/failsafe/lost_action.py`, and its tables."""

from dataclasses import replace
from typing import Any

import pytest

from onboard_agent.autopilot.flight_modes import modes_of
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.failsafe.lost_action import RUNG_PATIENCE_S, Loss, LostActionRunner, situation
from onboard_agent.failsafe.lost_action_table import (
    NEXT,
    REPORTED_ACTION,
    RESPONSES,
    LossResponse,
    LostEvent,
    Situation,
)
from wire.autopilots.profile import FailsafeModes as Modes
from wire.autopilots.px4_multicopter import custom_mode as px4_custom_mode
from wire.control_messages import SafetySettings
from wire.dialect import decode, mavlink
from wire.open_holds import Lost, LostAction, LostPhase

STEP_S = 0.025
COPTER, PX4 = modes_of(3, 2), modes_of(12, 2)
ALT_HOLD, AUTO, GUIDED, LOITER, RTL, LAND, SMART_RTL = 2, 3, 4, 5, 6, 9, 21


class Bench:
    """A drone in the air that loses tower or person at second 0, and a clock that the test advances."""

    def __init__(
        self,
        action: LostAction = LostAction.RETURN,
        *,
        mode: int = ALT_HOLD,
        modes: Modes | None = COPTER,
        after_s: float = 30.0,
        mission_before: bool = False,
        lost: Lost = Lost.TOWER,
    ) -> None:
        self.now = self.lost_at = 100.0
        self.lost = lost
        self.stayed = self.drifts = self.battery_due = False
        self.other_lost_at: float | None = None
        """Time at which the tower is lost as well as the person."""
        self.settings = SafetySettings(lost_action=action, lost_action_s=after_s)
        self.mode, self.modes, self.mission_before = mode, modes, mission_before
        self.ours = True
        self.acting = LostActionRunner(FrameMaker())
        self.actions: list[tuple[float, LossResponse]] = []
        self.sent: list[Any] = []
        self.lines: list[str] = []

    def until(self, second: float) -> "Bench":
        while self.now < self.lost_at + second:
            response = self.acting.tick(self.now, loss=self.loss(), settings=self.settings, modes=self.modes)
            if response is not None:
                self.actions.append((round(self.now - self.lost_at, 1), response))
            frames = self.acting.due(self.now, vehicle_system_id=1)
            self.sent += [decode(frame) for frame in frames]
            self.lines += self.acting.pop_notices()
            self.now += STEP_S
        return self

    def loss(self) -> Loss:
        gone_s = self.now - self.lost_at
        tower_at = self.lost_at if self.lost is Lost.TOWER else self.other_lost_at
        return Loss(
            tower_gone_s=0.0 if tower_at is None else max(0.0, self.now - tower_at),
            person_gone_s=gone_s if self.lost is Lost.PERSON and gone_s >= 0.0 else None,
            stayed=self.stayed,
            ours=self.ours,
            custom_mode=self.mode,
            mission_before_hold=self.mission_before,
            drifts=self.drifts,
            battery_due=self.battery_due,
        )

    def ack(self, result: int) -> "Bench":
        self.acting.acknowledged(mavlink.MAVLink_command_ack_message(176, result), self.now)
        return self

    def asked(self) -> list[tuple[int, int]]:
        return [(int(m.param2), int(m.param3)) for m in self.sent if m.command == 176]


def test_it_returns_when_the_time_is_up_and_not_before() -> None:
    bench = Bench().until(29.9)
    assert (bench.actions, bench.sent) == ([], [])
    bench.until(30.1)
    assert bench.actions == [(30.0, LossResponse.RETURN)]
    assert bench.asked() == [(RTL, 0)]


def test_it_counts_aloud() -> None:
    bench = Bench().until(31.0)
    counted = [int(line.split(" ")[-2]) for line in bench.lines if " in " in line]
    assert counted == [28, 20, 10, 5, 4, 3, 2, 1]
    assert bench.lines[0] == "the tower is lost: return in 28 s"


def test_it_is_confirmed_by_both_and_said() -> None:
    bench = Bench().until(30.1).ack(0)
    assert bench.acting.phase is LostPhase.ASKING
    bench.acting.heartbeat(RTL)
    assert bench.acting.phase is LostPhase.DONE
    bench.until(60.0)
    assert bench.lines[-1] == "RTL confirmed"
    assert len(bench.asked()) == 1
    assert len(bench.actions) == 1


def test_it_is_asked_for_again_until_then() -> None:
    bench = Bench().until(30.0 + 1.05)
    assert bench.asked() == [(RTL, 0)] * 5


def test_return_that_is_refused_becomes_land() -> None:
    bench = Bench().until(30.05).ack(mavlink.MAV_RESULT_FAILED).until(30.1)
    assert bench.asked() == [(RTL, 0), (LAND, 0)]
    bench.ack(0).acting.heartbeat(LAND)
    assert bench.acting.phase is LostPhase.DONE


def test_a_return_that_is_shown_but_never_answered_is_not_left_for_a_landing() -> None:
    bench = Bench().until(30.1)
    bench.acting.heartbeat(RTL)
    bench.mode = RTL
    while bench.now < bench.lost_at + 50.0:
        bench.until(bench.now - bench.lost_at + 0.9)
        bench.acting.heartbeat(RTL)
    assert set(bench.asked()) == {(RTL, 0)}


def test_silence_is_no_refusal_for_a_while() -> None:
    bench = Bench().until(30.0 + RUNG_PATIENCE_S - 0.1)
    assert set(bench.asked()) == {(RTL, 0)}
    bench.until(30.0 + RUNG_PATIENCE_S + 2.0)
    assert bench.asked()[-1] == (LAND, 0)


def test_land_lands() -> None:
    bench = Bench(LostAction.LAND, after_s=5.0, mode=GUIDED).until(5.1)
    assert (bench.actions[0][1], bench.asked()) == (LossResponse.LAND, [(LAND, 0)])


def test_a_mission_goes_on_where_that_is_wanted() -> None:
    bench = Bench(LostAction.CONTINUE, mode=AUTO).until(40.0)
    assert (bench.actions, bench.sent) == ([], [])
    assert bench.lines == ["the tower is lost: leave it as it is"]
    assert bench.acting.phase is LostPhase.QUIET


def test_a_mission_that_the_loss_has_stopped_is_resumed_where_that_is_wanted() -> None:
    bench = Bench(LostAction.CONTINUE, mode=ALT_HOLD, mission_before=True).until(30.1)
    assert (bench.actions[0][1], bench.asked()) == (LossResponse.RESUME_MISSION, [(AUTO, 0)])


@pytest.mark.parametrize("lost", list(Lost))
@pytest.mark.parametrize("action", [LostAction.STAY, LostAction.CONTINUE])
def test_staying_ends_when_the_battery_is_needed_for_the_way_home(action: LostAction, lost: Lost) -> None:
    bench = Bench(action, lost=lost).until(29.9)
    assert (bench.acting.phase, bench.acting.action) == (LostPhase.COUNTING, LostAction.STAY)
    bench.until(600.0)
    assert (bench.acting.phase, bench.acting.due_in_s, bench.actions) == (LostPhase.STAYED, None, [])
    bench.battery_due = True
    bench.until(600.1)
    assert bench.actions == [(600.0, LossResponse.RETURN)]
    assert bench.asked() == [(RTL, 0)]
    assert "the battery is needed for the way home" in bench.lines


def test_a_battery_that_is_needed_ends_a_count_that_would_be_too_long() -> None:
    bench = Bench(after_s=600.0, lost=Lost.PERSON).until(20.0)
    bench.battery_due = True
    bench.until(29.0)
    assert bench.acting.due_in_s == pytest.approx(1.0, abs=0.1)
    assert bench.actions == []
    bench.until(30.1)
    assert [response for _, response in bench.actions] == [LossResponse.RETURN]


@pytest.mark.parametrize("lost", list(Lost))
@pytest.mark.parametrize("action", [LostAction.RETURN, LostAction.LAND])
def test_stay_ends_the_count_for_a_person_and_not_for_the_tower(action: LostAction, lost: Lost) -> None:
    bench = Bench(action, lost=lost).until(10.0)
    bench.stayed = True
    bench.until(40.0)
    if lost is Lost.TOWER:
        assert [response for _, response in bench.actions] == [LossResponse(action.value)]
        return
    assert (bench.acting.phase, bench.acting.due_in_s, bench.actions) == (LostPhase.STAYED, None, [])
    bench.battery_due = True
    bench.until(41.0)
    assert (bench.acting.phase, bench.actions) == (LostPhase.COUNTING, []), "nobody is surprised"
    bench.until(50.1)
    assert bench.asked() == [(RTL if action is LostAction.RETURN else LAND, 0)]


def test_a_tower_that_is_lost_after_somebody_said_stay_counts_from_its_own_loss() -> None:
    bench = Bench(lost=Lost.PERSON).until(10.0)
    bench.stayed = True
    bench.until(100.0)
    bench.other_lost_at = bench.now
    bench.until(110.0)
    assert (bench.acting.phase, bench.acting.lost) == (LostPhase.COUNTING, Lost.TOWER)
    assert bench.acting.due_in_s == pytest.approx(20.0, abs=0.1)
    bench.until(131.0)
    assert bench.actions == [(130.0, LossResponse.RETURN)]


def test_who_said_stay_and_is_gone_until_the_next_hold_is_counted_again() -> None:
    bench = Bench(lost=Lost.PERSON).until(10.0)
    bench.stayed = True
    bench.until(20.0)
    bench.stayed = False
    bench.lost_at = bench.now
    bench.until(5.0)
    assert bench.acting.phase is LostPhase.COUNTING
    assert bench.acting.due_in_s == pytest.approx(25.0, abs=0.1)


@pytest.mark.parametrize("action", list(LostAction))
def test_without_a_position_nothing_stays_when_the_tower_is_lost(action: LostAction) -> None:
    bench = Bench(action)
    bench.drifts = True
    bench.until(5.0)
    assert bench.acting.action is LostAction.LAND
    bench.until(30.1)
    assert bench.actions == [(30.0, LossResponse.LAND)]
    assert bench.asked() == [(LAND, 0)]


def test_without_a_position_it_may_stay_while_the_tower_sees_it() -> None:
    bench = Bench(LostAction.STAY, lost=Lost.PERSON)
    bench.drifts = True
    bench.until(60.0)
    assert (bench.acting.phase, bench.actions) == (LostPhase.STAYED, [])


def test_what_will_be_done_is_told_while_it_is_counted_and_follows_the_situation() -> None:
    bench = Bench(lost=Lost.PERSON).until(5.0)
    assert (bench.acting.lost, bench.acting.action) == (Lost.PERSON, LostAction.RETURN)
    assert bench.acting.due_in_s == pytest.approx(25.0, abs=0.1)
    bench.drifts = True
    bench.until(6.0)
    assert bench.acting.action is LostAction.LAND


def test_a_person_is_counted_from_the_first_second() -> None:
    bench = Bench(lost=Lost.PERSON).until(0.1)
    assert bench.acting.phase is LostPhase.COUNTING
    assert bench.lines == ["the person is lost: return in 30 s"]


def test_a_hold_that_begins_anew_counts_anew() -> None:
    bench = Bench().until(31.0).ack(0)
    bench.acting.heartbeat(RTL)
    assert bench.acting.phase is LostPhase.DONE
    bench.acting.restart()
    assert (bench.acting.phase, bench.acting.lost, bench.acting.action) == (LostPhase.QUIET, None, None)
    bench.lost_at = bench.now
    bench.until(30.1)
    assert [response for _, response in bench.actions] == [LossResponse.RETURN, LossResponse.RETURN]


def test_one_that_went_home_while_it_was_counted_is_left_alone() -> None:
    bench = Bench().until(20.0)
    bench.mode = RTL
    bench.until(40.0)
    assert bench.actions == [(30.0, LossResponse.LEAVE)]
    assert (bench.sent, bench.acting.phase) == ([], LostPhase.DONE)


@pytest.mark.parametrize("mode", [RTL, LAND, SMART_RTL])
@pytest.mark.parametrize("action", list(LostAction))
def test_what_goes_home_already_is_left_alone(mode: int, action: LostAction) -> None:
    bench = Bench(action, mode=mode).until(40.0)
    assert (bench.actions, bench.sent, bench.lines) == ([], [], [])


def test_a_tower_that_comes_back_in_time_calls_it_off_and_the_next_loss_counts_anew() -> None:
    bench = Bench().until(25.0)
    bench.lost_at = bench.now + 5.0
    bench.until(0.0).until(29.9)
    assert bench.actions == []
    bench.until(30.1)
    assert [response for _, response in bench.actions] == [LossResponse.RETURN]


def test_a_tower_that_comes_back_later_changes_nothing_and_ends_the_asking() -> None:
    bench = Bench().until(31.0)
    bench.sent = []
    bench.lost_at = bench.now + 5.0
    bench.until(1.0)
    assert bench.sent == []
    assert bench.acting.phase is LostPhase.QUIET


def test_what_is_on_the_ground_or_not_ours_is_left_alone() -> None:
    bench = Bench()
    bench.ours = False
    bench.until(40.0)
    assert (bench.actions, bench.lines) == ([], [])


def test_landing_ends_it() -> None:
    bench = Bench().until(31.0)
    bench.ours = False
    bench.sent = []
    bench.until(35.0)
    assert bench.sent == []
    assert bench.acting.phase is LostPhase.QUIET


def test_a_vehicle_whose_modes_are_not_known_is_left_to_its_autopilot() -> None:
    bench = Bench(modes=None, mode=11).until(31.0)
    assert bench.actions == [(30.0, LossResponse.STOP_STICKS)]
    assert "no such mode is known" in bench.lines[-1]


def test_a_short_time_may_be_over_before_it_is_noticed() -> None:
    bench = Bench(after_s=2.0).until(2.1)
    assert bench.actions == [(2.0, LossResponse.RETURN)]


def test_px4_returns_and_lands_by_its_own_numbers() -> None:
    bench = Bench(modes=PX4, mode=px4_custom_mode(2, 0)).until(30.05).ack(mavlink.MAV_RESULT_DENIED).until(30.1)
    assert bench.asked() == [(4, 5), (4, 6)]
    bench.ack(0).acting.heartbeat(px4_custom_mode(4, 6))
    assert bench.acting.phase is LostPhase.DONE


@pytest.mark.parametrize(
    ("modes", "mode", "mission_before", "expected"),
    [
        (COPTER, RTL, False, Situation.GOING_HOME),
        (COPTER, 27, False, Situation.GOING_HOME),
        (COPTER, AUTO, False, Situation.ON_MISSION),
        (COPTER, AUTO, True, Situation.ON_MISSION),
        (COPTER, GUIDED, False, Situation.OTHERWISE),
        (COPTER, ALT_HOLD, True, Situation.HELD_ON_MISSION),
        (PX4, px4_custom_mode(4, 4), False, Situation.ON_MISSION),
        (PX4, px4_custom_mode(4, 5), False, Situation.GOING_HOME),
        (PX4, px4_custom_mode(4, 3), False, Situation.OTHERWISE),
        (None, RTL, True, Situation.OTHERWISE),
    ],
)
def test_what_the_drone_is_doing(modes: Modes | None, mode: int, mission_before: bool, expected: Situation) -> None:
    loss = Loss(tower_gone_s=30.0, custom_mode=mode, mission_before_hold=mission_before)
    assert situation(loss, modes) is expected


@pytest.mark.parametrize("mode", [ALT_HOLD, AUTO, GUIDED, LOITER])
def test_what_has_no_position_can_neither_return_nor_stay_unless_it_lands_already(mode: int) -> None:
    drifts = Loss(tower_gone_s=30.0, custom_mode=mode, mission_before_hold=True, drifts=True)
    assert situation(drifts, COPTER) is Situation.NO_POSITION
    assert situation(Loss(tower_gone_s=30.0, custom_mode=LAND, drifts=True), COPTER) is Situation.GOING_HOME


def test_the_tables_have_every_cell_and_a_way_out_of_every_phase() -> None:
    assert set(RESPONSES) == {(action, one) for action in LostAction for one in Situation}
    assert all(RESPONSES[action, Situation.GOING_HOME] is LossResponse.LEAVE for action in LostAction)
    assert set(REPORTED_ACTION) == set(LossResponse)
    for phase in LostPhase:
        if phase is not LostPhase.QUIET:
            assert NEXT[phase, LostEvent.BACK] is LostPhase.QUIET
            assert NEXT[phase, LostEvent.CALLED_OFF] is LostPhase.QUIET


class OnItsOwn(Bench):
    """The autopilot returns by itself at `own_at_s`, because it hears no ground station."""

    own_at_s: float | None = 15.0
    own_action = LostAction.RETURN

    def loss(self) -> Loss:
        loss = super().loss()
        if self.own_at_s is None:
            return loss
        return replace(loss, own=(self.own_action, self.own_at_s - (self.now - self.lost_at)))


@pytest.mark.parametrize("lost", list(Lost))
@pytest.mark.parametrize("action", [LostAction.CONTINUE, LostAction.STAY, LostAction.RETURN])
def test_what_the_autopilot_does_first_is_counted(action: LostAction, lost: Lost) -> None:
    bench = OnItsOwn(action, mode=AUTO, lost=lost).until(5.0)
    acting = bench.acting
    assert (acting.phase, acting.action) == (LostPhase.COUNTING, LostAction.RETURN)
    assert acting.due_in_s is not None and abs(acting.due_in_s - 10.0) < 0.1
    bench.until(15.2).mode = RTL
    bench.until(60.0)
    assert (acting.phase, acting.action, bench.sent) == (LostPhase.DONE, LostAction.RETURN, [])


def test_a_mission_without_anybody_counts_what_the_autopilot_does() -> None:
    bench = OnItsOwn(mode=AUTO, lost=Lost.PERSON)
    bench.lost_at += 1000.0  # nobody needs to be there: the mission was started to fly alone
    bench.own_at_s = -990.0
    bench.until(-999.0)
    assert (bench.acting.phase, bench.acting.lost) == (LostPhase.COUNTING, Lost.PERSON)
    assert bench.lines == ["the autopilot hears no ground station: return in 10 s"]
    bench.own_at_s = None  # somebody is at the controls again
    bench.until(-998.0)
    assert (bench.acting.phase, bench.acting.due_in_s) == (LostPhase.QUIET, None)


def test_what_the_agent_does_first_is_counted_as_ever() -> None:
    bench = OnItsOwn(LostAction.LAND, after_s=10.0)
    bench.until(5.0)
    assert (bench.acting.action, bench.acting.due_in_s is not None) == (LostAction.LAND, True)
    assert bench.until(10.2).actions == [(10.0, LossResponse.LAND)]


def test_an_autopilot_that_does_not_act_hears_another_station() -> None:
    bench = OnItsOwn(LostAction.CONTINUE, mode=AUTO).until(19.0)
    assert (bench.acting.phase, bench.acting.due_in_s) == (LostPhase.COUNTING, 0.0)
    assert bench.until(25.0).acting.phase is LostPhase.QUIET
