"""The tower's work goes to its handler, and its result to a tower that supports it: rules of `Transactions`."""

from typing import Any

import pytest

from onboard_agent.transactions.handler import Around
from onboard_agent.transactions.transactions import AGAIN_WITHIN_S, MAX_WAITING, NOT_HERE, RESULTS_KEPT, Transactions
from wire.dialect import build, mavlink
from wire.plans import PlanKind
from wire.transactions import (
    CommandWork,
    LogListWork,
    Outcome,
    ParameterCache,
    ParametersReadWork,
    ParametersWriteWork,
    PlanDownloadWork,
    PlanOnBoard,
    Transaction,
    TransactionProgress,
    TransactionResult,
)

AROUND = Around(
    system_id=1,
    autopilot_kind=3,
    vehicle_type=2,
    heard=True,
    armed=False,
    airborne=False,
    custom_mode=5,
    starting=False,
    flown_by_hand=False,
    holding=False,
    commanded=0,
    narrow_line=False,
)


class RecordingHandler:
    """A handler that does what the test says, and records its calls."""

    def __init__(self, *works: type, hears: tuple[int, ...] = ()) -> None:
        self.works = works
        self.hears = frozenset(hears)
        self.begun: list[int] = []
        self.cancelled: list[int] = []
        self.epochs: list[int] = []
        self.to_send: list[Any] = []
        self.sent_again = 0
        self.answers_us = False

    def autopilot_came(self, around: Around, now: float) -> None: ...

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        self.begun.append(transaction.id)

    def cancel(self, transaction_id: int, now: float) -> None:
        self.cancelled.append(transaction_id)

    def epoch_changed(self, epoch: int, now: float) -> None:
        self.epochs.append(epoch)

    def receive(self, frame: bytes, now: float) -> bool:
        return self.answers_us

    def due(self, around: Around, now: float) -> list[bytes]:
        return []

    def reports(self) -> list[Any]:
        reported, self.to_send = self.to_send, []
        return reported

    def resend(self) -> None:
        self.sent_again += 1


def transaction(number: int, work: Any, *, epoch: int = 1) -> Transaction:
    return Transaction(id=number, epoch=epoch, deadline_s=10, work=work)


def result(number: int) -> TransactionResult:
    return TransactionResult(id=number, outcome=Outcome.DONE, words="Done.")


def progress(number: int, done: int) -> TransactionProgress:
    return TransactionProgress(id=number, phase="writing", done=done, total=9)


def with_a_handler(*works: type, taken: bool = True) -> tuple[Transactions, RecordingHandler]:
    handler = RecordingHandler(*works)
    transactions = Transactions([handler])
    transactions.link_up(taken=taken)
    transactions.due(AROUND, 100.0)
    return transactions, handler


def test_each_piece_of_work_goes_to_its_handler_and_what_nobody_does_is_refused() -> None:
    plans, parameters = RecordingHandler(PlanDownloadWork), RecordingHandler(ParametersReadWork)
    transactions = Transactions([plans, parameters])
    transactions.link_up(taken=True)
    transactions.begin(transaction(1, PlanDownloadWork(PlanKind.FENCE)), AROUND, 0.0)
    transactions.begin(transaction(2, ParametersReadWork()), None, 0.0)
    transactions.begin(transaction(3, LogListWork()), AROUND, 0.0)
    assert (plans.begun, parameters.begun) == ([1], [2])
    (refused,) = transactions.reports()
    assert isinstance(refused, TransactionResult)
    assert (refused.id, refused.outcome) == (3, Outcome.REFUSED)
    transactions.cancel(2, 0.0)
    assert 2 in parameters.cancelled


def test_whoever_cancels_what_is_not_here_is_told_so() -> None:
    transactions, handler = with_a_handler(PlanDownloadWork)
    transactions.begin(transaction(1, PlanDownloadWork(PlanKind.FENCE)), AROUND, 0.0)
    transactions.cancel(1, 0.0)
    transactions.cancel(2, 0.0)
    assert handler.cancelled == [1]
    (unknown,) = transactions.reports()
    assert isinstance(unknown, TransactionResult)
    assert (unknown.id, unknown.outcome, unknown.words) == (2, Outcome.REFUSED, NOT_HERE)
    handler.to_send = [result(1)]
    transactions.cancel(1, 0.0)  # it ends at this moment
    transactions.reports()
    transactions.cancel(1, 0.0)  # and has been reported
    assert transactions.reports() == []


def test_what_writes_is_refused_under_an_older_epoch_and_what_reads_is_not() -> None:
    transactions, handler = with_a_handler(CommandWork, ParametersWriteWork, PlanDownloadWork)
    transactions.epoch_changed(5, 0.0)
    transactions.epoch_changed(5, 0.0)
    assert handler.epochs == [5]
    for number, work in enumerate((CommandWork(400), ParametersWriteWork((("A", 1.0),)))):
        transactions.begin(transaction(number, work, epoch=4), AROUND, 0.0)
    assert handler.begun == []
    assert [one.outcome for one in transactions.reports()] == [Outcome.STALE_EPOCH] * 2  # type: ignore[union-attr]
    transactions.begin(transaction(7, PlanDownloadWork(PlanKind.FENCE), epoch=4), AROUND, 0.0)
    transactions.begin(transaction(8, CommandWork(400), epoch=5), AROUND, 0.0)
    assert handler.begun == [7, 8]
    transactions.epoch_changed(2, 0.0)
    transactions.begin(transaction(9, CommandWork(400), epoch=2), AROUND, 0.0)
    assert handler.begun == [7, 8, 9], "a tower whose database was restored can have work done"


def test_a_tower_that_does_not_take_it_is_told_nothing() -> None:
    transactions, handler = with_a_handler(taken=False)
    handler.to_send = [progress(1, 1), PlanOnBoard(kind=PlanKind.RALLY, hash=None), result(1)]
    assert transactions.reports() == []
    transactions.link_up(taken=True)
    assert transactions.reports() == [result(1)], "results wait; the state comes from the handlers"
    assert handler.sent_again == 2


def test_what_may_be_lost_with_a_control_channel_is_told_again_on_the_next() -> None:
    transactions, handler = with_a_handler()
    handler.to_send = [result(1)]
    assert transactions.reports() == [result(1)]
    transactions.due(AROUND, 100.0 + AGAIN_WITHIN_S + 1.0)
    handler.to_send = [result(2)]
    assert transactions.reports() == [result(2)]
    transactions.link_up(taken=True)
    assert transactions.reports() == [result(2)], "the first has been there long enough to have arrived"
    transactions.link_down()
    transactions.due(AROUND, 5000.0)
    handler.to_send = [result(3)]
    assert transactions.reports() == []
    transactions.link_up(taken=True)
    assert transactions.reports() == [result(2), result(3)], "the time without a link does not count"


def test_an_id_that_is_begun_anew_has_no_older_result() -> None:
    transactions, handler = with_a_handler(PlanDownloadWork)
    handler.to_send = [result(1), result(2)]
    transactions.reports()
    transactions.link_down()
    transactions.link_up(taken=True)
    transactions.begin(transaction(1, PlanDownloadWork(PlanKind.FENCE)), AROUND, 0.0)
    assert transactions.reports() == [result(2)]


def test_only_the_newest_progress_and_state_wait_and_none_of_what_is_over() -> None:
    transactions, handler = with_a_handler()
    old, new = (PlanOnBoard(kind=PlanKind.RALLY, hash=None, count=count) for count in (1, 2))
    fence = PlanOnBoard(kind=PlanKind.FENCE, hash=None)
    handler.to_send = [old, fence, *(progress(1, done) for done in range(5)), progress(2, 1), result(2), new]
    assert transactions.reports(room=0) == []
    assert transactions.reports(room=2) == [fence, progress(1, 4)]
    assert transactions.reports() == [result(2), new]


def test_where_too_much_waits_the_state_is_told_anew_and_results_stay() -> None:
    transactions, handler = with_a_handler()
    handler.to_send = [result(1), *(ParameterCache(hash=None, count=n, total=999) for n in range(MAX_WAITING))]
    assert transactions.reports(room=0) == []
    assert handler.sent_again == 2
    assert transactions.reports() == [result(1)]
    handler.to_send = [result(number) for number in range(200)]
    assert len(transactions.reports()) == RESULTS_KEPT


@pytest.mark.parametrize("answers_us", [True, False])
def test_what_answers_a_handler_alone_need_not_go_up(answers_us: bool) -> None:
    handlers = [RecordingHandler(hears=(44,)), RecordingHandler(hears=(44, 22))]
    transactions = Transactions(handlers)
    assert transactions.hears == {22, 44}
    handlers[1].answers_us = answers_us
    frame = build(mavlink.MAVLink_mission_count_message(1, 191, 3), system_id=1, component_id=1, sequence=0)
    assert transactions.receive(frame, 0.0) is answers_us
