"""The hold as a state machine: each rule of `onboard_agent/failsafe/hold.py`, and the table itself."""

from dataclasses import replace
from typing import Any

import pytest

from onboard_agent.autopilot.flight_modes import hold_rungs, modes_of
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.failsafe.flying import Flying
from onboard_agent.failsafe.hold import DEADLINE_S, Hold
from onboard_agent.failsafe.hold_table import NEXT, OPEN, HoldEvent, HoldPhase
from onboard_agent.sticks.held_sticks import STICKS_INTERVAL_S
from wire.autopilots.profile import FailsafeModes as Modes
from wire.autopilots.profile import FlightMode
from wire.control_messages import HoldCause, HoldStep
from wire.dialect import decode, mavlink

ALT_HOLD = 2
STEP_S = 0.025


def copter() -> Modes:
    modes = modes_of(3, 2)
    assert modes is not None
    return modes


STAYS = copter().pauses


def rungs(*names: str) -> tuple[FlightMode, ...]:
    return hold_rungs(copter(), names)


def test_a_second_hold_that_takes_as_long_is_told_apart_from_a_copy_of_the_first() -> None:
    hold = Hold(FrameMaker())
    reported = []
    for now in (100.0, 200.0):
        hold.begin(cause=HoldCause.STICKS_STALE, order_id=0, epoch=4, rungs=(), stays=(), armed=True, now=now)
        hold.tick(now, Flying())
        reported += hold.pop_progress()
    assert len(reported) == 4
    assert len(set(reported)) == 4


class Bench:
    """A hold of stage one alone, with a clock that the test advances. Keeps what was sent and reported."""

    def __init__(
        self,
        *names: str,
        cause: HoldCause = HoldCause.ORDER,
        armed: bool = True,
        modes: tuple[FlightMode, ...] | None = None,
    ) -> None:
        self.now = 100.0
        self.hold = Hold(FrameMaker())
        self.sent: list[Any] = []
        self.steps: list[HoldStep] = []
        self.details: list[str] = []
        self.flying = Flying(airborne=False)
        self.cause = cause
        self.begin(rungs(*names) if modes is None else modes, armed=armed)

    def begin(self, modes: tuple[FlightMode, ...], *, armed: bool = True) -> None:
        self.hold.begin(
            cause=self.cause,
            order_id=9,
            epoch=4,
            rungs=modes,
            stays=STAYS if modes else (),
            armed=armed,
            now=self.now,
            why="" if self.cause is HoldCause.ORDER else "why",
        )
        self.collect()

    def collect(self) -> None:
        for progress in self.hold.pop_progress():
            assert (progress.order_id, progress.epoch, progress.cause) == (9, 4, self.cause)
            self.steps.append(progress.step)
            self.details.append(progress.detail)

    def pass_time(self, for_s: float) -> None:
        end = self.now + for_s
        while self.now < end:
            frames = self.hold.tick(self.now, self.flying)
            self.sent += [decode(frame) for frame in frames]
            self.now += STEP_S
        self.collect()

    def ack(self, result: int) -> None:
        self.hold.acknowledged(mavlink.MAVLink_command_ack_message(176, result), self.now)
        self.collect()

    def heartbeat(self, custom_mode: int, *, armed: bool = True) -> None:
        self.hold.heartbeat(armed=armed, custom_mode=custom_mode, now=self.now)
        self.collect()

    def take_sent(self, kind: str) -> list[Any]:
        found = [m for m in self.sent if m.get_type() == kind]
        self.sent = []
        return found


def test_the_straight_way() -> None:
    bench = Bench()
    bench.pass_time(0.1)
    bench.ack(mavlink.MAV_RESULT_ACCEPTED)
    bench.heartbeat(ALT_HOLD)
    assert bench.steps == ["sticks_centred", "mode_requested", "mode_acknowledged", "confirmed"]
    assert bench.hold.phase is HoldPhase.CONFIRMED
    assert bench.hold.sticks_on


def test_sticks_are_centred_at_20_hz_as_the_ground_station() -> None:
    bench = Bench()
    bench.pass_time(2.0)
    sticks = [m for m in bench.sent if m.get_type() == "MANUAL_CONTROL"]
    assert len(sticks) == pytest.approx(2.0 / STICKS_INTERVAL_S, abs=1)
    assert {(m.x, m.y, m.z, m.r, m.buttons, m.target) for m in sticks} == {(0, 0, 500, 0, 0, 1)}
    assert {(m.get_srcSystem(), m.get_srcComponent()) for m in sticks} == {(255, 190)}


def test_the_mode_is_asked_for_again_with_a_growing_confirmation() -> None:
    bench = Bench()
    bench.pass_time(1.1)
    asked = bench.take_sent("COMMAND_LONG")
    assert [m.confirmation for m in asked] == [0, 1, 2, 3, 4]
    assert {(m.command, m.param1, m.param2, m.target_system, m.target_component) for m in asked} == {(176, 1, 2, 1, 1)}
    assert {(m.get_srcSystem(), m.get_srcComponent()) for m in asked} == {(1, 191)}


def test_an_acknowledgement_alone_confirms_nothing() -> None:
    bench = Bench()
    bench.pass_time(0.1)
    bench.ack(mavlink.MAV_RESULT_ACCEPTED)
    bench.heartbeat(5)
    bench.pass_time(DEADLINE_S)
    assert bench.steps[-2:] == ["mode_acknowledged", "unconfirmed"]
    assert "heartbeat does not show" in bench.details[-1]


def test_a_heartbeat_alone_confirms_nothing() -> None:
    bench = Bench()
    bench.pass_time(0.1)
    bench.heartbeat(ALT_HOLD)
    assert bench.steps[-1] == "mode_requested"
    bench.ack(mavlink.MAV_RESULT_ACCEPTED)
    assert bench.steps[-2:] == ["mode_acknowledged", "confirmed"]


def test_after_the_deadline_it_is_tried_more_slowly_and_may_still_succeed() -> None:
    bench = Bench()
    bench.pass_time(DEADLINE_S + 0.05)
    assert bench.steps[-1] == "unconfirmed"
    assert bench.details[-1] == "no answer from the autopilot to ALT_HOLD"
    bench.sent = []
    bench.pass_time(5.0)
    assert 4 <= len(bench.take_sent("COMMAND_LONG")) <= 6
    bench.ack(mavlink.MAV_RESULT_ACCEPTED)
    bench.heartbeat(ALT_HOLD)
    assert bench.steps[-2:] == ["mode_acknowledged", "confirmed"]
    assert bench.steps.count(HoldStep.UNCONFIRMED) == 1


def test_a_refusal_is_named() -> None:
    bench = Bench()
    bench.pass_time(0.1)
    bench.ack(mavlink.MAV_RESULT_DENIED)
    bench.pass_time(DEADLINE_S)
    assert bench.details[-1] == "the autopilot refuses ALT_HOLD: DENIED"


def test_in_progress_means_wait_longer() -> None:
    bench = Bench()
    bench.pass_time(0.1)
    bench.ack(mavlink.MAV_RESULT_IN_PROGRESS)
    bench.sent = []
    bench.pass_time(0.9)
    assert bench.take_sent("COMMAND_LONG") == []


def test_disarming_ends_it() -> None:
    bench = Bench()
    bench.pass_time(0.1)
    bench.heartbeat(5, armed=False)
    assert bench.steps[-1] == "not_needed"
    bench.sent = []
    bench.pass_time(10.0)
    assert not bench.hold.open
    assert {m.command for m in bench.sent} == {mavlink.MAV_CMD_REQUEST_MESSAGE}, "watched for an arming"


def test_it_has_no_end_by_time() -> None:
    bench = Bench()
    bench.pass_time(0.1)
    bench.ack(mavlink.MAV_RESULT_ACCEPTED)
    bench.heartbeat(ALT_HOLD)
    bench.now += 3600.0
    bench.sent = []
    bench.pass_time(5.0)
    assert len(bench.take_sent("MANUAL_CONTROL")) == pytest.approx(5.0 / STICKS_INTERVAL_S, abs=1)
    assert bench.hold.open


@pytest.mark.parametrize("cause", [HoldCause.PILOT_LOST, HoldCause.STICKS_STALE])
def test_a_hold_of_the_agents_own_tells_that_it_began_and_why(cause: HoldCause) -> None:
    bench = Bench(cause=cause)
    bench.pass_time(0.1)
    assert (bench.steps[0], bench.details[0]) == ("ordered", "why")


def test_the_new_holders_sticks_end_ours_but_not_the_wish_for_the_mode() -> None:
    bench = Bench()
    bench.pass_time(0.1)
    bench.hold.sticks_come((copter().altitude_hold,), bench.now)
    bench.sent = []
    bench.pass_time(0.5)
    assert {m.get_type() for m in bench.sent} == {"COMMAND_LONG"}


def test_sticks_that_come_before_a_mode_without_sticks_is_confirmed_end_the_hold_with_a_report() -> None:
    bench = Bench("BRAKE")
    bench.flying = replace(bench.flying, pilot_fresh=True)
    bench.pass_time(0.1)
    assert bench.steps[-1] == "mode_requested"
    bench.hold.sticks_come((copter().altitude_hold,), bench.now)
    bench.pass_time(0.1)
    assert (bench.steps[-1], bench.details[-1]) == ("unconfirmed", "the sticks were taken up")
    bench.ack(mavlink.MAV_RESULT_ACCEPTED)
    bench.heartbeat(ALT_HOLD)
    bench.pass_time(0.1)
    assert not bench.hold.open
    assert bench.steps[-1] == "unconfirmed", "one report of the end"


@pytest.mark.parametrize(("needs_sticks", "still"), [(False, set()), (True, {"MANUAL_CONTROL"})])
def test_the_new_holders_command_wins(needs_sticks: bool, still: set[str]) -> None:
    bench = Bench()
    bench.pass_time(0.1)
    bench.hold.overruled(needs_sticks=needs_sticks, now=bench.now)
    bench.sent = []
    bench.pass_time(1.0)
    assert {m.get_type() for m in bench.sent} == still
    assert bench.steps[-1] == "unconfirmed"
    assert bench.details[-1] == "the holder has commanded otherwise"


def test_a_vehicle_without_such_a_mode_gets_sticks_and_the_truth() -> None:
    bench = Bench(modes=())
    bench.pass_time(DEADLINE_S + 0.1)
    assert {m.get_type() for m in bench.sent} == {"MANUAL_CONTROL"}
    assert bench.details[-1] == "no altitude-hold mode is known for this vehicle"


def test_a_second_order_begins_anew() -> None:
    bench = Bench()
    bench.pass_time(0.1)
    bench.ack(mavlink.MAV_RESULT_ACCEPTED)
    bench.heartbeat(ALT_HOLD)
    bench.begin(rungs())
    bench.pass_time(0.1)
    assert bench.steps[-2:] == ["sticks_centred", "mode_requested"]


def test_a_late_acknowledgement_after_the_end_means_nothing() -> None:
    bench = Bench()
    bench.pass_time(0.1)
    bench.hold.overruled(needs_sticks=False, now=bench.now)
    bench.collect()
    steps = list(bench.steps)
    bench.ack(mavlink.MAV_RESULT_ACCEPTED)
    bench.heartbeat(ALT_HOLD)
    assert bench.steps == steps


@pytest.mark.parametrize("phase", [p for p in HoldPhase if p is not HoldPhase.IDLE])
def test_the_table_leads_out_of_every_phase(phase: HoldPhase) -> None:
    assert NEXT[phase, HoldEvent.OVERRULED][0] is HoldPhase.IDLE
    disarmed = HoldPhase.WATCHING if phase is HoldPhase.WATCHING else NEXT[phase, HoldEvent.DISARMED][0]
    assert disarmed in (HoldPhase.WATCHING, HoldPhase.IDLE)
    assert NEXT[HoldPhase.WATCHING, HoldEvent.WATCHED][0] is HoldPhase.IDLE


def test_no_time_leads_out_of_a_hold() -> None:
    ends = {event for (phase, event), (after, _) in NEXT.items() if phase in OPEN and after not in OPEN}
    assert ends == {HoldEvent.DISARMED, HoldEvent.OVERRULED}


def test_the_table_reports_confirmed_only_where_both_have_been_seen() -> None:
    to_confirmed = [key for key, (phase, _) in NEXT.items() if phase is HoldPhase.CONFIRMED]
    assert to_confirmed == [(HoldPhase.ACKNOWLEDGED, HoldEvent.MODE_SHOWN)]
    assert all((step is HoldStep.CONFIRMED) == (phase is HoldPhase.CONFIRMED) for phase, step in NEXT.values())


def test_an_autopilot_that_is_found_after_the_order_is_asked_then() -> None:
    bench = Bench(modes=())
    bench.pass_time(0.5)
    bench.hold.modes_became_known(rungs(), STAYS, bench.now)
    bench.hold.modes_became_known(rungs(), STAYS, bench.now)
    bench.pass_time(0.1)
    assert [m.param2 for m in bench.take_sent("COMMAND_LONG")] == [ALT_HOLD]
    bench.ack(mavlink.MAV_RESULT_ACCEPTED)
    bench.heartbeat(ALT_HOLD)
    assert bench.steps == ["sticks_centred", "mode_requested", "mode_acknowledged", "confirmed"]


def test_the_first_sticks_and_the_first_request_go_out_in_the_same_call() -> None:
    bench = Bench("LOITER")
    frames = bench.hold.tick(bench.now, bench.flying)
    assert [decode(frame).get_type() for frame in frames] == ["MANUAL_CONTROL", "COMMAND_LONG"]


def test_a_ladder_is_climbed_step_by_step_and_each_is_told() -> None:
    bench = Bench("LOITER")
    bench.pass_time(0.05)
    bench.ack(mavlink.MAV_RESULT_FAILED)
    bench.pass_time(0.05)
    bench.ack(mavlink.MAV_RESULT_ACCEPTED)
    bench.heartbeat(ALT_HOLD)
    assert bench.steps == ["sticks_centred", "mode_requested", "mode_requested", "mode_acknowledged", "confirmed"]
    assert bench.details[1:] == [
        "LOITER",
        "ALT_HOLD (the autopilot refuses LOITER: FAILED)",
        "ALT_HOLD",
        "ALT_HOLD",
    ]
    assert bench.hold.sticks_on


def test_a_ladder_of_which_nothing_is_granted_is_told_rung_by_rung_and_tried_on() -> None:
    bench = Bench("LOITER", "POSHOLD", "BRAKE")
    bench.pass_time(DEADLINE_S + 0.1)
    asked = [m.param2 for m in bench.take_sent("COMMAND_LONG")]
    assert list(dict.fromkeys(asked)) == [5, 16, 17, ALT_HOLD], "altitude hold before the deadline"
    assert bench.steps[-1] == "unconfirmed"
    assert bench.details[-1].count("no answer from the autopilot to ") == 4
    bench.pass_time(10.0)
    later = [m.param2 for m in bench.take_sent("COMMAND_LONG")]
    assert set(later) == {ALT_HOLD}
    assert 9 <= len(later) <= 11
