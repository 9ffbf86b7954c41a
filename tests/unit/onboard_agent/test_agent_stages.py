"""The two stages of a hold, by the motion of the vehicle: rules of `hold.py` and `stay_stage.py` together."""

from dataclasses import replace
from typing import Any

import pytest

from onboard_agent.autopilot.flight_modes import hold_rungs, modes_of
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.failsafe.flying import Flying
from onboard_agent.failsafe.hold import Hold
from onboard_agent.failsafe.stay_stage import SINKING_WAIT_S, SLOW_DOWN_S, TRY_AGAIN_S, UNKNOWN_WAIT_S
from wire.autopilots.profile import FailsafeModes as Modes
from wire.autopilots.profile import FlightMode
from wire.control_messages import HoldCause
from wire.dialect import decode, mavlink
from wire.open_holds import AfterSticks, HoldStage

STEP_S = 0.025
ALT_HOLD, GUIDED, LOITER, BRAKE = 2, 4, 5, 17
FAILED = mavlink.MAV_RESULT_FAILED


def copter() -> Modes:
    modes = modes_of(3, 2)
    assert modes is not None
    return modes


def with_receiver(custom_mode: int) -> AfterSticks:
    return AfterSticks.SINKS if custom_mode in (ALT_HOLD, LOITER) else AfterSticks.STAYS


def guided_alone(custom_mode: int) -> AfterSticks:
    return AfterSticks.STAYS if custom_mode == GUIDED else AfterSticks.RETURNS


def nothing_stays(custom_mode: int) -> AfterSticks:
    return AfterSticks.RETURNS


class Bench:
    """A hold of a vehicle in the air, with an autopilot that obeys everything except `refuses`."""

    def __init__(
        self, *, ladder: tuple[str, ...] = (), flying: Flying | None = None, refuses: frozenset[int] = frozenset()
    ) -> None:
        self.now = 100.0
        self.hold = Hold(FrameMaker())
        self.flying = flying or Flying(after_sticks=with_receiver)
        self.refuses = refuses
        self.mode = LOITER
        self.asked: list[int] = []
        self.sticks: list[tuple[float, int]] = []
        self.rungs = hold_rungs(copter(), ladder)

    def begin(self, *, sticks: bool = True, stays: tuple[FlightMode, ...] | None = None) -> "Bench":
        self.hold.begin(
            cause=HoldCause.ORDER,
            order_id=1,
            epoch=5,
            rungs=self.rungs,
            stays=copter().pauses if stays is None else stays,
            armed=True,
            now=self.now,
            sticks=sticks,
        )
        return self

    def pass_time(self, for_s: float) -> "Bench":
        end = self.now + for_s - STEP_S / 2
        while self.now < end:
            for frame in self.hold.tick(self.now, self.flying):
                self.take(decode(frame))
            self.now += STEP_S
        return self

    def take(self, message: Any) -> None:
        if message.get_type() == "MANUAL_CONTROL":
            self.sticks.append((self.now, message.z))
        elif message.command == mavlink.MAV_CMD_DO_SET_MODE:
            wanted = int(message.param2)
            self.asked.append(wanted)
            refused = wanted in self.refuses
            self.hold.acknowledged(mavlink.MAVLink_command_ack_message(176, FAILED if refused else 0), self.now)
            if not refused:
                self.shows(wanted)

    def shows(self, mode: int) -> None:
        self.mode = mode
        self.hold.heartbeat(armed=True, custom_mode=mode, now=self.now)

    def sees(self, **changes: Any) -> "Bench":
        self.flying = replace(self.flying, **changes)
        return self

    def sticks_come(self, for_s: float = 1.0) -> bool:
        self.sticks.clear()
        self.pass_time(for_s)
        return bool(self.sticks)


def test_stage_two_follows_at_once_where_the_machine_is_ready_for_it() -> None:
    bench = Bench().begin().pass_time(0.2)
    assert bench.asked == [ALT_HOLD, BRAKE]
    assert (bench.hold.stage, bench.hold.open) == (HoldStage.STAY, True)
    assert not bench.sticks_come()


@pytest.mark.parametrize(
    ("not_ready", "words"),
    [
        ({"level": False}, "not level yet"),
        ({"has_position": False}, "no position"),
        ({"airborne": False}, "it is on the ground"),
    ],
)
def test_what_is_not_ready_waits_in_stage_one_with_sticks_and_says_why(not_ready: dict[str, Any], words: str) -> None:
    bench = Bench().sees(**not_ready).begin().pass_time(30.0)
    assert bench.asked == [ALT_HOLD]
    assert (bench.hold.stage, bench.hold.waiting_for) == (HoldStage.ALTITUDE, words)
    assert bench.sticks_come()
    bench.sees(level=True, has_position=True, sinking=False, airborne=True).pass_time(0.5)
    assert (bench.hold.stage, bench.hold.waiting_for) == (HoldStage.STAY, "")


def test_a_descent_that_centred_sticks_do_not_stop_is_not_waited_for_for_ever() -> None:
    bench = Bench().sees(sinking=True).begin().pass_time(SINKING_WAIT_S - 0.1)
    assert (bench.asked, bench.hold.waiting_for) == ([ALT_HOLD], "still sinking")
    bench.pass_time(0.3)
    assert bench.asked == [ALT_HOLD, BRAKE]


def test_what_is_fast_slows_down_first_and_not_for_ever() -> None:
    bench = Bench().sees(fast=True).begin().pass_time(SLOW_DOWN_S - 0.1)
    assert (bench.asked, bench.hold.waiting_for) == ([ALT_HOLD], "not slow enough yet")
    bench.pass_time(0.3)
    assert bench.asked == [ALT_HOLD, BRAKE]


def test_an_autopilot_that_does_not_tell_its_tilt_is_waited_for_and_then_believed_to_be_level() -> None:
    bench = Bench().sees(level=None).begin().pass_time(UNKNOWN_WAIT_S - 0.1)
    assert bench.asked == [ALT_HOLD]
    bench.pass_time(0.3)
    assert bench.asked == [ALT_HOLD, BRAKE]


def test_what_is_refused_is_asked_for_again_in_a_while_and_stage_one_goes_on() -> None:
    bench = Bench(refuses=frozenset({BRAKE, GUIDED})).begin().pass_time(1.0)
    assert bench.asked == [ALT_HOLD, BRAKE, GUIDED]
    assert bench.hold.stage is HoldStage.ALTITUDE
    assert "refuses BRAKE" in bench.hold.waiting_for
    assert bench.sticks_come(TRY_AGAIN_S - 1.5)
    bench.refuses = frozenset({BRAKE})
    bench.pass_time(1.0)
    assert (bench.mode, bench.hold.stage) == (GUIDED, HoldStage.STAY)


def test_the_mode_that_does_not_mind_the_end_of_sticks_is_preferred() -> None:
    bench = Bench(flying=Flying(after_sticks=guided_alone)).begin().pass_time(0.5)
    assert bench.asked == [ALT_HOLD, GUIDED]
    assert not bench.sticks_come()


def test_where_none_stays_sticks_go_on_for_as_long_as_it_takes() -> None:
    bench = Bench(flying=Flying(after_sticks=nothing_stays)).begin().pass_time(600.0)
    assert (bench.mode, bench.hold.stage) == (BRAKE, HoldStage.STAY)
    assert bench.sticks_come()


def test_what_becomes_known_later_lets_the_sticks_go_or_leads_to_a_better_mode() -> None:
    unknown = Flying(after_sticks=lambda custom_mode: AfterSticks.UNKNOWN)
    bench = Bench(flying=unknown).begin().pass_time(5.0)
    assert bench.mode == BRAKE
    assert bench.sticks_come()
    bench.sees(after_sticks=guided_alone, still=False).pass_time(1.0)
    assert bench.mode == BRAKE, "not while it still brakes"
    bench.sees(still=True).pass_time(0.5)
    assert bench.mode == GUIDED
    assert not bench.sticks_come()


def test_a_position_that_is_lost_in_stage_two_means_sticks_and_altitude_hold_in_the_same_call() -> None:
    bench = Bench().begin().pass_time(3.0)
    bench.sees(has_position=False)
    bench.sticks.clear()
    bench.asked.clear()
    for _ in range(2):  # the position watch reports it at each tick
        bench.hold.back_to_altitude(copter().altitude_hold, bench.now)
    bench.pass_time(STEP_S)
    assert bench.asked == [ALT_HOLD]
    assert len(bench.sticks) == 1
    assert bench.sticks_come(60.0)
    assert (bench.mode, bench.hold.stage, bench.hold.waiting_for) == (ALT_HOLD, HoldStage.ALTITUDE, "no position")


def test_near_the_ground_and_sinking_the_stick_climbs() -> None:
    bench = Bench().sees(low_and_sinking=True, sinking=True).begin().pass_time(1.0)
    assert {z for _, z in bench.sticks} == {1000}
    bench.sees(low_and_sinking=False)
    bench.sticks.clear()
    bench.pass_time(1.0)
    assert {z for _, z in bench.sticks} == {500}


def test_a_ladder_that_names_a_mode_that_stays_needs_no_stage_one() -> None:
    bench = Bench(ladder=("BRAKE",)).begin().pass_time(0.5)
    assert bench.asked == [BRAKE]
    assert bench.hold.stage is HoldStage.STAY
    assert not bench.sticks_come()


def test_what_flies_without_sticks_is_held_without_any_and_what_refuses_gets_them() -> None:
    bench = Bench().begin(sticks=False).pass_time(1.0)
    assert (bench.asked, bench.sticks) == ([BRAKE], [])
    assert bench.hold.stage is HoldStage.STAY
    refused = Bench(refuses=frozenset({BRAKE, GUIDED})).begin(sticks=False).pass_time(1.0)
    assert refused.asked[:3] == [BRAKE, GUIDED, ALT_HOLD]
    assert refused.hold.stage is HoldStage.ALTITUDE
    assert refused.sticks_come()


def test_a_vehicle_without_such_a_mode_stays_in_stage_one() -> None:
    bench = Bench().begin(stays=()).pass_time(30.0)
    assert bench.asked == [ALT_HOLD]
    assert bench.hold.stage is HoldStage.ALTITUDE
    assert bench.sticks_come()


def test_sticks_that_come_in_stage_two_get_a_mode_that_obeys_them() -> None:
    bench = Bench().begin().pass_time(2.0)
    bench.asked.clear()
    bench.hold.sticks_come((copter().position_holds[0], copter().altitude_hold), bench.now)
    bench.pass_time(3.0)
    assert bench.asked == [LOITER]
    assert not bench.hold.open
    assert not bench.sticks_come(5.0), "they are the pilot's"


def test_a_pilot_whose_sticks_came_before_stage_one_was_confirmed_is_left_alone_afterwards() -> None:
    bench = Bench()
    bench.refuses = frozenset({ALT_HOLD})
    bench.begin().pass_time(1.0)
    bench.hold.sticks_come((copter().altitude_hold,), bench.now)
    bench.asked.clear()
    bench.pass_time(20.0)
    assert not {BRAKE, GUIDED} & set(bench.asked), "no stage two under a pilot's hand"
    bench.asked.clear()
    bench.pass_time(20.0)
    assert bench.asked == [], "and nothing is asked for for ever"


def test_a_command_for_a_mode_of_sticks_in_stage_two_is_flown_with_centred_ones() -> None:
    bench = Bench().begin().pass_time(2.0)
    assert not bench.sticks_come(0.5)
    bench.hold.overruled(needs_sticks=True, now=bench.now)
    bench.asked.clear()
    assert bench.sticks_come(5.0)
    assert bench.asked == []
    assert bench.hold.open, "nobody flies it"
    bench.hold.sticks_come((), bench.now)
    assert not bench.hold.open
    assert not bench.sticks_come()


def test_a_wish_is_waited_for_without_a_mode_but_with_the_sticks_that_there_are() -> None:
    bench = Bench().sees(level=False).begin().pass_time(1.0)
    bench.hold.wait()
    bench.sees(level=True)
    bench.asked.clear()
    assert bench.sticks_come(1.0)
    assert bench.asked == []
    bench.hold.go_on()
    bench.pass_time(0.3)
    assert bench.mode == BRAKE


def test_where_another_mode_is_asked_for_none_of_the_holds_is_and_sticks_stay_as_they_are() -> None:
    bench = Bench().sees(has_position=False).begin().pass_time(2.0)
    bench.hold.yield_mode()
    bench.asked.clear()
    bench.sees(has_position=True)
    assert bench.sticks_come(10.0)
    assert bench.asked == []


def test_an_order_that_must_not_interrupt_is_answered_and_nothing_else() -> None:
    bench = Bench()
    bench.hold.stand_aside(order_id=3, epoch=9, now=bench.now, why="the drone is in RTL, and goes on with it")
    assert not bench.sticks_come()
    (reported,) = bench.hold.pop_progress()
    assert (reported.order_id, reported.epoch, reported.step, reported.detail) == (
        3,
        9,
        "not_needed",
        "the drone is in RTL, and goes on with it",
    )
    assert not bench.hold.open


def test_a_mode_that_nobody_here_asked_for_is_seen() -> None:
    bench = Bench().begin().pass_time(2.0)
    bench.shows(6)
    bench.pass_time(0.8)
    bench.shows(6)
    assert bench.hold.foreign_mode(bench.now) == 6
