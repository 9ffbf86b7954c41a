"""Plans are uploaded and downloaded with the simulator's own server half, without faults and with each named fault."""

from __future__ import annotations

from functools import partial

import pytest
from plan_line import (
    NEW,
    OLD,
    Failure,
    InPlaceServer,
    Line,
    Outcome,
    PlanClearWork,
    PlanDownloadWork,
    PlanOnBoard,
    PlanUploadWork,
    PlanVerifyWork,
    SimulatorServer,
    TransactionProgress,
    waypoints,
)

from simulator.dialect import Codec, Message, mavlink
from simulator.px4.flavour import PX4
from wire.autopilots.ardupilot_plans import ArduPilot
from wire.autopilots.px4_plans import Px4
from wire.plan_keeping import as_kept
from wire.plans import PlanItem, PlanKind, pack_plan, plan_hash

FENCE = tuple(PlanItem(5001, 0, (3.0, 0.0, 0.0, 0.0), 473970000 + i * 1000, 85450000 - i * i) for i in range(3))
RALLY = (PlanItem(5100, 3, x=473980000, y=85460000, z=42.5),)
PLANS = {PlanKind.MISSION: NEW, PlanKind.FENCE: FENCE, PlanKind.RALLY: RALLY}


def line_with(*failures: Failure) -> Line:
    line = Line(partial(SimulatorServer, failures=failures))
    line.server.on_reset = lambda: setattr(line, "silent_until", line.now + 4.0)
    line.load(OLD)
    return line


@pytest.mark.parametrize("kind", list(PlanKind))
def test_a_plan_goes_up_is_read_back_and_comes_down(kind: PlanKind) -> None:
    line = line_with()
    plan = PLANS[kind]
    result = line.upload(plan, kind)
    assert result.outcome is Outcome.DONE, result.words
    kept = as_kept(ArduPilot(), kind, plan)
    assert line.on_board(kind) == kept
    reported = line.reported(PlanOnBoard)[-1]
    assert (reported.hash, reported.count, reported.plan, reported.fit_to_fly) == (
        plan_hash(kind, kept),
        len(plan),
        pack_plan(kind, kept),
        True,
    )
    assert reported.sent_hash == plan_hash(kind, plan)
    assert line.journal.records == {}
    assert line.do(PlanDownloadWork(kind)).plan == pack_plan(kind, kept)
    assert line.do(PlanVerifyWork(kind, plan)).outcome is Outcome.DONE
    other = line.do(PlanVerifyWork(kind, (*plan[:-1], PlanItem(17))))
    assert (other.outcome, other.item) == (Outcome.FAILED, len(plan) - 1)
    assert line.do(PlanClearWork(kind)).outcome is Outcome.DONE
    assert line.on_board(kind) == ()
    assert line.do(PlanDownloadWork(kind)).plan == pack_plan(kind, ())


@pytest.mark.parametrize("flavour", [None, PX4], ids=["ardupilot", "px4"])
def test_jumps_and_numbers_are_those_of_the_plan_whatever_the_autopilot_counts(flavour: object) -> None:
    make = SimulatorServer if flavour is None else partial(SimulatorServer, flavour=flavour)
    line = Line(make, home_slot=flavour is None)
    plan = (*waypoints(3), PlanItem(177, 2, (1.0, 2.0, 0.0, 0.0)))
    assert line.upload(plan).outcome is Outcome.DONE
    jump = line.server.plan(PlanKind.MISSION)[-1]
    assert jump.params[0] == (2.0 if flavour is None else 1.0)
    assert len(line.server.plan(PlanKind.MISSION)) == (5 if flavour is None else 4)
    kept = as_kept(ArduPilot() if flavour is None else Px4(), PlanKind.MISSION, plan)
    assert kept[-1].params == plan[-1].params
    assert line.do(PlanDownloadWork(PlanKind.MISSION)).plan == pack_plan(PlanKind.MISSION, kept)


def test_what_the_autopilot_does_not_keep_is_told_and_what_matters_first() -> None:
    line = line_with()
    quiet = line.upload((PlanItem(20, 2), PlanItem(22, 6, z=20.0)))
    assert quiet.words.endswith("ArduPilot keeps 2 values differently, with no effect on the flight.")
    flown = line.upload((PlanItem(20, 2), PlanItem(16, 3, (2.5, 0.0, 0.0, 90.0), 473970000, 85450000, 20.0)))
    assert flown.outcome is Outcome.DONE
    assert "Item 2: ArduPilot keeps parameter 1 as 2, not 2.5. There are 1 more of these." in flown.words


def test_a_plan_that_comes_back_in_every_bit_is_that_plan_whatever_its_autopilot_usually_keeps() -> None:
    line = line_with(Failure.MISSION_VERBATIM)
    result = line.upload((PlanItem(16, 3, (2.5, 0.0, 0.0, 0.0), 473970000, 85450000, 20.0),))
    assert (result.outcome, result.words.endswith("read back and compared: 1 items.")) == (Outcome.DONE, True)


def test_a_fence_of_one_circle_after_a_polygon_stays_though_the_autopilot_drops_it_once() -> None:
    line = line_with()
    assert line.upload(FENCE, PlanKind.FENCE).outcome is Outcome.DONE
    line.run(1.0)
    circle = (PlanItem(5003, 0, (30.0, 0.0, 0.0, 0.0), 473970000, 85450000),)
    assert line.upload(circle, PlanKind.FENCE).outcome is Outcome.DONE
    line.run(2.0)
    assert line.on_board(PlanKind.FENCE) == as_kept(ArduPilot(), PlanKind.FENCE, circle)


@pytest.mark.parametrize(
    ("failure", "expected"),
    [
        (Failure.FIRST_MISSION_REQUEST_IGNORED, "new"),
        (Failure.MISSION_FINAL_ACK_MISSING, "new"),
        (Failure.OLD_MISSION_REQUESTS, "new"),
        (Failure.MISSION_WRONG_SEQUENCE, "new"),
        (Failure.MISSION_REQUESTS_TWICE, "new"),
        (Failure.MISSION_WRITTEN_IN_PLACE, "new"),
        (Failure.REBOOT_DURING_UPLOAD, "old"),
        (Failure.MISSION_FULL, "old"),
    ],
)
def test_each_named_failure_leaves_one_whole_plan_and_says_so(failure: Failure, expected: str) -> None:
    line = line_with(failure)
    result = line.upload(NEW)
    assert line.on_board() == (NEW if expected == "new" else OLD)
    assert result.outcome is (Outcome.DONE if expected == "new" else Outcome.FAILED), result.words
    assert ("on board, read back" if expected == "new" else "The old mission is untouched.") in result.words
    assert line.handler.why_no_start is None
    assert line.journal.records == {}


@pytest.mark.parametrize("in_place", [False, True])
def test_half_a_plan_that_was_acknowledged_too_early_is_noticed_and_replaced(in_place: bool) -> None:
    line = line_with(Failure.MISSION_ENDS_EARLY, *([Failure.MISSION_WRITTEN_IN_PLACE] if in_place else []))
    result = line.upload(NEW)
    assert result.outcome is Outcome.FAILED
    assert result.words == (
        "The autopilot took it, but 2 items of 5 are on board. The mission on board is unknown: do not fly it."
    )  # for the old one ends early too
    assert line.on_board() not in (OLD, NEW) and line.handler.why_no_start is not None
    line.server.failures.clear()
    line.run(20.0)
    assert line.on_board() == OLD and line.handler.why_no_start is None


def test_each_tenth_frame_lost_both_ways_costs_time_and_nothing_else() -> None:
    line = line_with()
    line.to_agent = line.to_server = lambda number, _message: 0 if number % 10 == 0 else 1
    plan = waypoints(60)
    result = line.upload(plan)
    assert result.outcome is Outcome.DONE, result.words
    assert line.on_board() == plan
    assert line.do(PlanDownloadWork(PlanKind.MISSION)).plan == pack_plan(PlanKind.MISSION, plan)


def test_every_frame_doubled_both_ways_changes_nothing() -> None:
    line = line_with()
    line.to_agent = line.to_server = lambda _number, _message: 2
    plan = waypoints(20)
    assert line.upload(plan).outcome is Outcome.DONE
    assert line.on_board() == plan
    assert line.do(PlanDownloadWork(PlanKind.MISSION)).plan == pack_plan(PlanKind.MISSION, plan)


def test_the_item_that_is_refused_is_named_by_the_plans_number_and_the_reason() -> None:
    line = line_with()
    plan = (*NEW[:3], PlanItem(31000, 3), *NEW[3:])
    result = line.upload(plan)
    assert (result.outcome, result.item, result.code) == (Outcome.FAILED, 3, "MAV_MISSION_UNSUPPORTED")
    assert result.words == ("Item 4: the autopilot does not know this command. The old mission is untouched.")
    assert line.on_board() == OLD


def test_a_refusal_in_the_middle_of_what_is_written_in_place_puts_the_old_plan_back() -> None:
    line = line_with(Failure.MISSION_WRITTEN_IN_PLACE)
    result = line.upload((*NEW[:3], PlanItem(31000, 3)))
    assert (result.outcome, result.item) == (Outcome.FAILED, 3)
    assert result.words.endswith("The old mission was put back.")
    assert line.on_board() == OLD
    assert line.handler.why_no_start is None


@pytest.mark.parametrize("in_place", [False, True])
def test_a_silent_autopilot_ends_in_words_and_a_refusal_to_fly_what_nobody_knows(in_place: bool) -> None:
    line = Line(InPlaceServer) if in_place else line_with()
    line.load(OLD)
    line.begin(PlanUploadWork(PlanKind.MISSION, NEW))
    while (line.on_board()[:1] != NEW[:1] and in_place) or line.journal.records == {}:
        line.step()
    line.silent_until = line.now + 300.0
    result = line.result(300.0)
    assert result.outcome is Outcome.FAILED
    assert "The mission on board is unknown: do not fly it." in result.words
    assert line.handler.why_no_start is not None and "Upload it again" in line.handler.why_no_start
    assert line.reported(PlanOnBoard)[-1].hash is None and not line.reported(PlanOnBoard)[-1].fit_to_fly
    line.silent_until = 0.0
    line.run(60.0)
    assert line.handler.why_no_start is None
    assert line.on_board() == OLD
    assert line.reported(PlanOnBoard)[-1].plan == pack_plan(PlanKind.MISSION, OLD)


def test_nothing_is_written_where_the_old_plan_cannot_be_read_or_the_journal_cannot_be_kept() -> None:
    line = line_with()
    line.silent_until = line.now + 60.0
    result = line.upload(NEW)
    assert result.outcome is Outcome.FAILED and "Nothing was written" in result.words
    line.silent_until = 0.0
    line.journal.broken = True
    result = line.upload(NEW)
    assert result.words == (
        "The agent cannot write its journal (No space left on device). "
        "Nothing was written; the plan on board is as it was."
    )
    assert line.on_board() == OLD and line.handler.why_no_start is None


def test_a_plan_that_is_there_already_is_not_written_again() -> None:
    line = line_with()
    sent: list[str] = []

    def listen(_number: int, message: Message) -> int:
        sent.append(message.get_type())
        return 1

    line.to_server = listen
    assert "already" in line.upload(OLD).words
    assert "MISSION_REQUEST_LIST" in sent and "MISSION_COUNT" not in sent


def test_progress_is_told_five_times_a_second_at_most_and_grows() -> None:
    line = line_with()
    line.begin(PlanUploadWork(PlanKind.MISSION, waypoints(200)))
    began = line.now
    line.result()
    progress = line.reported(TransactionProgress)
    assert 3 < len(progress) <= 5 * (line.now - began) + 2
    writing = [one.done for one in progress if one.phase == "writing"]
    assert writing == sorted(writing) and {one.total for one in progress if one.phase == "writing"} == {200}


def test_a_second_one_is_refused_as_busy_whatever_its_kind() -> None:
    line = line_with()
    line.begin(PlanUploadWork(PlanKind.FENCE, FENCE))
    line.run(0.05)
    refused = line.do(PlanDownloadWork(PlanKind.MISSION))
    assert (refused.outcome, refused.words) == (Outcome.REFUSED, "Busy: the fence is being written.")
    line.run(3.0)
    assert line.on_board(PlanKind.FENCE) == as_kept(ArduPilot(), PlanKind.FENCE, FENCE)


def test_while_a_plan_is_written_no_mission_is_started_and_nobody_else_writes() -> None:
    line = line_with()
    assert line.handler.why_no_start is None and not line.handler.keeps_out(44)
    line.begin(PlanUploadWork(PlanKind.MISSION, NEW))
    assert line.handler.why_no_start == "The mission is being written. No mission can start now."
    assert line.handler.keeps_out(44) and line.handler.keeps_out(73) and not line.handler.keeps_out(43)
    line.result()
    assert line.handler.why_no_start is None and not line.handler.keeps_out(44)
    line.begin(PlanDownloadWork(PlanKind.MISSION))
    assert line.handler.why_no_start is None and not line.handler.keeps_out(44)


@pytest.mark.parametrize("server", [SimulatorServer, InPlaceServer])
@pytest.mark.parametrize("how", ["cancel", "epoch", "deadline"])
def test_stopping_an_upload_at_any_step_leaves_the_old_plan_or_the_new_one_that_was_done(
    server: type, how: str
) -> None:
    outcomes = {"cancel": Outcome.CANCELLED, "epoch": Outcome.STALE_EPOCH, "deadline": Outcome.TIMED_OUT}
    seen = set()
    for steps in range(0, 60, 2):
        line = Line(server)
        line.load(OLD)
        number = line.begin(
            PlanUploadWork(PlanKind.MISSION, NEW), deadline_s=(steps + 0.5) / 100 if how == "deadline" else 60
        )
        line.run(steps / 100)
        if how == "cancel":
            line.handler.cancel(number, line.now)
        elif how == "epoch":
            line.handler.epoch_changed(2, line.now)
        result = line.result()
        seen.add(result.outcome)
        assert line.on_board() == (NEW if result.outcome is Outcome.DONE else OLD), (steps, result.words)
        assert line.handler.why_no_start is None and line.journal.records == {}
    assert seen == {outcomes[how], Outcome.DONE}


def test_what_writes_under_an_older_epoch_is_refused_and_what_reads_is_not() -> None:
    line = line_with()
    line.handler.epoch_changed(5, line.now)
    assert line.do(PlanUploadWork(PlanKind.MISSION, NEW), epoch=4).outcome is Outcome.STALE_EPOCH
    assert line.do(PlanDownloadWork(PlanKind.MISSION), epoch=4).plan == pack_plan(PlanKind.MISSION, OLD)
    assert line.do(PlanUploadWork(PlanKind.MISSION, NEW), epoch=5).outcome is Outcome.DONE


def heard(line: Line, message: Message, system: int = 1, component: int = 1) -> None:
    line.handler.receive(Codec(system, component).encode(message), line.now)


@pytest.mark.parametrize(
    ("sender", "target"), [((1, 154), (1, 191)), ((2, 1), (1, 191)), ((1, 1), (1, 190)), ((1, 1), (255, 191))]
)
def test_a_refusal_by_others_or_to_others_changes_nothing(sender: tuple[int, int], target: tuple[int, int]) -> None:
    line = line_with()

    def refused_by_others() -> None:
        heard(line, mavlink.MAVLink_mission_ack_message(*target, mavlink.MAV_MISSION_NO_SPACE, 0), *sender)

    line.on_step = refused_by_others
    assert line.upload(NEW).outcome is Outcome.DONE
    assert line.on_board() == NEW


def test_a_refusal_of_another_kind_of_plan_changes_nothing_and_one_of_ours_ends_it() -> None:
    for kind, outcome in ((1, Outcome.DONE), (0, Outcome.FAILED)):
        line = line_with()
        line.begin(PlanUploadWork(PlanKind.MISSION, NEW))
        while not line.journal.records and line.now < 110.0:
            line.step()
        heard(line, mavlink.MAVLink_mission_ack_message(1, 191, mavlink.MAV_MISSION_NO_SPACE, kind))
        assert line.result().outcome is outcome


def test_an_item_that_is_not_in_the_plan_is_never_sent() -> None:
    line = line_with()
    sent: list[int] = []

    def listen(_number: int, message: Message) -> int:
        if message.get_type() == "MISSION_ITEM_INT":
            sent.append(message.seq)
        return 1

    line.to_server = listen
    line.on_step = lambda: heard(line, mavlink.MAVLink_mission_request_int_message(1, 191, len(NEW) + 1, 0))
    assert line.upload(NEW).outcome is Outcome.DONE
    assert sorted(set(sent)) == list(range(len(NEW) + 1))


@pytest.mark.parametrize(("flavour", "ahead"), [(None, 5), (PX4, 1)], ids=["ardupilot", "px4"])
def test_items_are_asked_for_ahead_only_of_an_autopilot_that_answers_each_by_itself(
    flavour: object, ahead: int
) -> None:
    make = SimulatorServer if flavour is None else partial(SimulatorServer, flavour=flavour)
    line = Line(make, home_slot=flavour is None)
    plan = waypoints(60)
    line.load(plan)
    asked: list[float] = []

    def listen(_number: int, message: Message) -> int:
        if message.get_type() == "MISSION_REQUEST_INT":
            asked.append(line.now)
        return 1

    line.to_server = listen
    began = line.now
    assert line.do(PlanDownloadWork(PlanKind.MISSION)).plan == pack_plan(PlanKind.MISSION, plan)
    assert max(asked.count(at) for at in asked) == ahead
    assert (line.now - began < 0.3) is (flavour is None)


def test_items_that_come_back_to_front_or_unasked_end_in_their_places() -> None:
    line = line_with()
    plan = waypoints(23)
    line.load(plan)
    step = line.step

    def turned_round() -> None:
        line._down.reverse()
        step()

    def unasked() -> None:
        of_another = waypoints(1, alt_m=99.0)[0]
        fields = (20, of_another.frame, of_another.command, 0, 1, 0.0, 0.0, 0.0, 0.0, of_another.x, of_another.y)
        heard(line, mavlink.MAVLink_mission_item_int_message(1, 191, *fields, of_another.z, 0))
        line.on_step = lambda: None

    line.step = turned_round  # type: ignore[method-assign]
    line.begin(PlanDownloadWork(PlanKind.MISSION))
    line.run(0.02)
    line.on_step = unasked
    assert line.result().plan == pack_plan(PlanKind.MISSION, plan)
