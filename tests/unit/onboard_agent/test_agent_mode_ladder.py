"""Requests for one mode after another: each rule of `mode_ladder.py`, and the modes of a ladder."""

from typing import Any

import pytest

from onboard_agent.autopilot.flight_modes import hold_rungs, modes_of
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.failsafe.mode_ladder import LadderStep, ModeLadder
from wire.autopilots.px4_multicopter import custom_mode as px4_custom_mode
from wire.dialect import decode, mavlink

STEP_S = 0.025
PATIENCE_S = 0.75
COPTER, PX4 = modes_of(3, 2), modes_of(12, 2)
LOITER, BRAKE, ALT_HOLD = 5, 17, 2
REFUSALS = [
    mavlink.MAV_RESULT_DENIED,
    mavlink.MAV_RESULT_FAILED,
    mavlink.MAV_RESULT_UNSUPPORTED,
    mavlink.MAV_RESULT_TEMPORARILY_REJECTED,
]


class Bench:
    """A ladder with a clock that the test advances."""

    def __init__(self, *names: str, modes: Any = COPTER) -> None:
        self.now = 10.0
        self.ladder = ModeLadder(FrameMaker())
        self.ladder.climb(hold_rungs(modes, names), patience_s=PATIENCE_S, now=self.now)
        self.sent: list[Any] = []
        self.reached: list[tuple[str, str]] = []

    def pass_time(self, for_s: float) -> "Bench":
        end = self.now + for_s
        while self.now < end:
            frames = self.ladder.due(self.now, vehicle_system_id=1)
            self.sent += [decode(frame) for frame in frames]
            self.now += STEP_S
        self.collect()
        return self

    def collect(self) -> None:
        self.reached += [(str(step), detail) for step, detail in self.ladder.pop_reached()]

    def ack(self, result: int) -> "Bench":
        self.ladder.acknowledged(mavlink.MAVLink_command_ack_message(176, result), self.now)
        self.collect()
        return self

    def beat(self, custom_mode: int) -> "Bench":
        self.ladder.heartbeat(custom_mode)
        self.collect()
        return self

    def asked(self) -> list[int]:
        modes = [int(m.param2) for m in self.sent if m.command == 176]
        self.sent = []
        return modes

    def steps(self) -> list[tuple[str, str]]:
        return [(step, detail.split(" ")[0]) for step, detail in self.reached]


def test_the_first_rung_is_enough_where_it_is_granted() -> None:
    bench = Bench("LOITER").pass_time(0.05).ack(0).beat(LOITER).pass_time(2.0)
    assert bench.asked() == [LOITER]
    assert bench.steps() == [("requested", "LOITER"), ("accepted", "LOITER"), ("confirmed", "LOITER")]


@pytest.mark.parametrize("refusal", REFUSALS)
def test_a_refused_rung_is_left_at_once(refusal: int) -> None:
    bench = Bench("LOITER").pass_time(0.02)
    bench.ack(refusal)
    bench.pass_time(0.02)
    assert bench.asked() == [LOITER, ALT_HOLD]


def test_a_silent_rung_is_left_after_three_requests() -> None:
    bench = Bench("LOITER").pass_time(PATIENCE_S - STEP_S)
    assert bench.asked() == [LOITER] * 3
    bench.pass_time(2 * STEP_S)
    assert bench.asked() == [ALT_HOLD]


def test_a_rung_that_is_accepted_but_not_shown_is_left_too() -> None:
    bench = Bench("LOITER").pass_time(0.05).ack(0).pass_time(PATIENCE_S)
    assert bench.asked()[-1] == ALT_HOLD
    assert "but the heartbeat does not show it" in bench.reached[-1][1]


def test_the_last_rung_is_never_left() -> None:
    bench = Bench().pass_time(0.05)
    bench.ack(mavlink.MAV_RESULT_FAILED)
    bench.pass_time(20.0)
    asked = bench.asked()
    assert set(asked) == {ALT_HOLD}
    assert 12 + 16 <= len(asked) <= 12 + 19, "four a second for three seconds, then one"
    bench.ack(0).beat(ALT_HOLD)
    assert bench.steps()[-1] == ("confirmed", "ALT_HOLD")


def test_an_earlier_rung_is_requested_again_while_a_later_one_waits_for_its_response() -> None:
    """The autopilot obeys in order: it would go from LOITER to ALT_HOLD, and the hold would not know."""
    bench = Bench("LOITER").pass_time(0.05).ack(0).pass_time(PATIENCE_S)
    assert bench.asked()[-1] == ALT_HOLD
    bench.beat(LOITER).pass_time(STEP_S)
    assert ("confirmed", "LOITER") not in bench.steps()
    assert bench.asked() == [LOITER]
    bench.ack(0).ack(0).ack(0).beat(ALT_HOLD).pass_time(STEP_S)
    assert ("confirmed", "ALT_HOLD") not in bench.steps()
    assert not bench.asked(), "LOITER is on its way"
    bench.ack(0).beat(LOITER).pass_time(2.0)
    assert bench.steps()[-1] == ("confirmed", "LOITER")
    assert not bench.asked(), "no more is asked for"


def test_a_lost_response_of_the_later_rung_does_not_keep_the_earlier_one_from_being_confirmed() -> None:
    bench = Bench("LOITER").pass_time(0.05).ack(0).pass_time(PATIENCE_S).beat(LOITER).pass_time(STEP_S)
    bench.ack(0).ack(0).ack(0).beat(LOITER)
    assert bench.steps()[-1] == ("confirmed", "LOITER")


def test_a_late_acceptance_of_the_newest_rung_is_settled_by_the_next_heartbeat() -> None:
    bench = Bench("LOITER").pass_time(PATIENCE_S + 0.1).ack(0)
    assert bench.ladder.asking
    bench.beat(ALT_HOLD)
    assert bench.steps()[-1] == ("confirmed", "ALT_HOLD")


def test_time_in_which_the_agent_did_not_run_counts_for_no_rung() -> None:
    """On a busy computer responses wait to be read: without this, a hold in BRAKE went on to ALT_HOLD, and sank."""
    bench = Bench("LOITER").pass_time(0.05)
    bench.now += 3.0
    bench.pass_time(STEP_S)
    assert set(bench.asked()) == {LOITER}
    bench.ack(0).beat(LOITER)
    assert bench.steps()[-1] == ("confirmed", "LOITER")


def test_a_computer_that_is_always_slow_goes_down_the_ladder_all_the_same() -> None:
    bench = Bench("LOITER")
    for _ in range(6):
        bench.pass_time(STEP_S)
        bench.now += 1.0
    assert bench.asked()[-1] == ALT_HOLD


def test_the_mode_it_was_in_does_not_confirm_by_another_rungs_answer() -> None:
    bench = Bench("LOITER").pass_time(0.05).beat(LOITER).pass_time(PATIENCE_S).ack(0)
    assert ("confirmed", "LOITER") not in bench.steps()
    bench.beat(ALT_HOLD)
    assert bench.steps()[-1] == ("confirmed", "ALT_HOLD")


def test_a_refused_rung_is_not_confirmed_by_a_stale_heartbeat() -> None:
    bench = Bench("LOITER").pass_time(0.02)
    bench.ack(mavlink.MAV_RESULT_FAILED)
    bench.pass_time(0.02)
    bench.ack(0).beat(LOITER)
    assert bench.steps()[-1] == ("accepted", "ALT_HOLD")


def test_in_progress_means_wait_longer_with_the_same_rung() -> None:
    bench = Bench("LOITER").pass_time(0.05).ack(mavlink.MAV_RESULT_IN_PROGRESS)
    bench.sent = []
    bench.pass_time(0.9)
    assert bench.asked() == []


def test_answers_to_nothing_mean_nothing() -> None:
    bench = Bench("LOITER").ack(0).beat(LOITER)
    assert bench.reached == []
    bench.ladder.stop()
    assert bench.pass_time(1.0).asked() == []


def shown_asked(bench: Bench) -> int:
    asked = sum((m.command, m.param1) == (mavlink.MAV_CMD_REQUEST_MESSAGE, 0) for m in bench.sent)
    bench.sent = []
    return asked


def test_what_is_accepted_but_not_shown_is_asked_to_be_shown() -> None:
    bench = Bench().pass_time(0.02)
    assert shown_asked(bench) == 0
    bench.ack(0).pass_time(0.02)
    assert shown_asked(bench) == 1, "at once"
    bench.pass_time(0.2)
    assert 3 <= shown_asked(bench) <= 4
    bench.beat(ALT_HOLD).pass_time(1.0)
    assert shown_asked(bench) == 0


def test_a_mode_that_is_never_shown_does_not_flood_the_line() -> None:
    bench = Bench().pass_time(0.02).ack(0).pass_time(3.0)
    bench.sent = []
    bench.pass_time(10.0)
    assert 9 <= shown_asked(bench) <= 11


def test_an_autopilot_that_takes_it_as_command_int_only_gets_it_so_at_once() -> None:
    bench = Bench("LOITER", "ALT_HOLD").pass_time(0.02).ack(mavlink.MAV_RESULT_COMMAND_INT_ONLY).pass_time(STEP_S)
    assert [one.get_type() for one in bench.sent] == ["COMMAND_LONG", "COMMAND_INT"]
    assert bench.asked() == [LOITER, LOITER], "it is not left for the next rung"
    bench.ack(0).beat(LOITER)
    assert bench.reached[-1] == (LadderStep.CONFIRMED, "LOITER")


def test_one_that_refuses_either_message_is_left() -> None:
    bench = Bench("LOITER", "ALT_HOLD").pass_time(0.02).ack(mavlink.MAV_RESULT_COMMAND_INT_ONLY).pass_time(STEP_S)
    bench.ack(mavlink.MAV_RESULT_COMMAND_INT_ONLY).pass_time(STEP_S)
    assert bench.asked() == [LOITER, LOITER, ALT_HOLD]


def test_an_empty_ladder_asks_for_nothing() -> None:
    bench = Bench(modes=None).pass_time(1.0)
    assert (bench.sent, bench.reached, bench.ladder.asking) == ([], [], False)


def test_px4s_main_and_sub_mode_go_apart_and_are_shown_together() -> None:
    bench = Bench("AUTO.LOITER", modes=PX4).pass_time(0.02)
    (message,) = bench.sent
    assert (message.param1, message.param2, message.param3) == (1, 4, 3)
    bench.ack(0).beat(px4_custom_mode(4, 3))
    assert bench.ladder.asking is False
    assert bench.reached[-1] == (LadderStep.CONFIRMED, "AUTO.LOITER")


@pytest.mark.parametrize(
    ("kind", "vehicle", "names", "rungs"),
    [
        (3, 2, (), ["ALT_HOLD"]),
        (3, 13, ("LOITER", "BRAKE"), ["LOITER", "BRAKE", "ALT_HOLD"]),
        (3, 2, ("BRAKE", "POSHOLD", "LOITER"), ["BRAKE", "POSHOLD", "LOITER", "ALT_HOLD"]),
        (3, 2, ("ALT_HOLD", "LOITER"), ["LOITER", "ALT_HOLD"]),
        (3, 2, ("LOITER", "LOITER"), ["LOITER", "ALT_HOLD"]),
        (3, 2, ("AUTO.LOITER", "FLIP", "POSHOLD"), ["POSHOLD", "ALT_HOLD"]),
        (12, 2, ("AUTO.LOITER", "POSCTL"), ["AUTO.LOITER", "POSCTL", "ALTCTL"]),
        (12, 2, ("LOITER",), ["ALTCTL"]),
        (3, 1, ("LOITER",), []),
        (12, 1, (), []),
        (8, 2, (), []),
        (0, 0, (), []),
    ],
)
def test_which_modes_a_ladder_has(kind: int, vehicle: int, names: tuple[str, ...], rungs: list[str]) -> None:
    assert [mode.name for mode in hold_rungs(modes_of(kind, vehicle), names)] == rungs


@pytest.mark.parametrize("refusal", REFUSALS)
def test_a_refusal_after_an_acceptance_counts(refusal: int) -> None:
    bench = Bench("AUTO.LOITER", modes=PX4).pass_time(STEP_S)
    bench.ack(mavlink.MAV_RESULT_ACCEPTED).ack(refusal)
    bench.pass_time(STEP_S)
    assert bench.asked() == [4, 2], "the next rung at once"
    assert "refuses AUTO.LOITER" in bench.ladder.why_not()
    bench.beat(px4_custom_mode(4, 3))
    assert bench.ladder.asking


def test_a_second_acceptance_changes_nothing() -> None:
    bench = Bench("AUTO.LOITER", modes=PX4).pass_time(STEP_S)
    bench.ack(mavlink.MAV_RESULT_ACCEPTED).ack(mavlink.MAV_RESULT_ACCEPTED).beat(px4_custom_mode(4, 3))
    assert [step for step, _ in bench.reached] == ["requested", "accepted", "confirmed"]


def test_a_mode_that_the_failsafe_has_chosen_is_not_confirmed() -> None:
    bench = Bench("AUTO.LOITER", modes=PX4).pass_time(STEP_S).ack(mavlink.MAV_RESULT_ACCEPTED)
    bench.ladder.heartbeat(px4_custom_mode(4, 3), by_failsafe=True)
    assert bench.ladder.asking
    bench.beat(px4_custom_mode(4, 3))
    assert not bench.ladder.asking


def test_a_mode_with_sticks_that_is_refused_after_an_acceptance_is_requested_again() -> None:
    bench = Bench("POSCTL", modes=PX4).pass_time(STEP_S)
    bench.ack(mavlink.MAV_RESULT_ACCEPTED).ack(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
    bench.pass_time(0.3)
    assert bench.asked() == [3, 3], "the first sticks had only just arrived"
    bench.ack(mavlink.MAV_RESULT_ACCEPTED).beat(px4_custom_mode(3, 0))
    assert bench.ladder.confirmed is not None and bench.ladder.confirmed.name == "POSCTL"
