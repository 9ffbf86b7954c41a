"""Routes the tower's transactions to their handlers, and the results back to the tower. No I/O.

Rules, each tested:
- A transaction goes to the handler of its work type. Each gets one result. Work without a handler, and writes of an
  epoch older than the known one, are refused here.
- Nothing is sent to a tower that has not announced support. Results wait for one that does.
- Messages sent shortly before a control channel is lost may be lost with it: results of the last AGAIN_WITHIN_S are
  sent again on the next one, and so is the state of every handler. An id that is begun again loses its older result.
- A cancel for a transaction that never arrived, or ended long ago, gets a result: the tower never waits in vain.
- Only the latest progress is queued, and none after the result. If the queue is too long, state is dropped and resent.
"""

import logging
from collections import deque
from collections.abc import Collection, Sequence
from typing import Final

from onboard_agent.transactions.handler import Around, TransactionHandler
from wire.controller_settings import CONTROLLER_SETTINGS, ControllerDescribed
from wire.controllers import ControllerWork
from wire.findings import FINDINGS, SIGHTINGS, TargetFound
from wire.following import FollowWork
from wire.frames import message_id
from wire.parameter_metadata import PARAMETER_METADATA, MetadataToTower
from wire.transactions import (
    CommandWork,
    Outcome,
    ParametersWriteWork,
    PlanClearWork,
    PlanOnBoard,
    PlanUploadWork,
    Transaction,
    TransactionProgress,
    TransactionResult,
    TransactionToTower,
)

_log = logging.getLogger(__name__)
WRITES: Final = (PlanUploadWork, PlanClearWork, ParametersWriteWork, CommandWork, FollowWork, ControllerWork)
"""Work that only the holder may request; it carries an epoch."""

AGAIN_WITHIN_S: Final = 60.0
"""Much longer than a control channel can be dead before either side notices."""

RESULTS_KEPT: Final = 16
"""Results to send again, or to keep until a tower is connected. A tower runs few at a time; the oldest are dropped."""

NOT_HERE: Final = "The agent does not know it: it never reached the drone, or it ended long ago."

MAX_WAITING: Final = 128
"""Maximum number of messages queued for the control channel."""


class Transactions:
    """Call `due` at each tick and after each `receive`; send the messages of `reports`. Pass the autopilot's frames of
    the types in `hears` to `receive`."""

    def __init__(self, handlers: Sequence[TransactionHandler]) -> None:
        self._handlers = tuple(handlers)
        self._handler_of = {work: handler for handler in handlers for work in handler.works}
        self.hears: frozenset[int] = frozenset[int]().union(*(handler.hears for handler in handlers))
        """Ids of the autopilot's messages that any handler takes."""
        self._epoch = 0
        self._taken = False
        self._takes: frozenset[str] = frozenset()
        self._now = 0.0
        self._waiting: deque[TransactionToTower] = deque()
        self._sent: deque[tuple[float, TransactionResult]] = deque(maxlen=RESULTS_KEPT)
        self._going_on: dict[int, str] = {}
        """Begun at a handler, and not ended: the trace of each, for the log."""

    # The link.

    def link_up(self, *, taken: bool, takes: Collection[str] = ()) -> None:
        """A new link, or another control channel of the same link. `taken`: the tower supports these messages.
        `takes`: from its welcome."""
        again = [result for at, result in self._sent if self._now - at <= AGAIN_WITHIN_S]
        self._sent.clear()
        results = [one for one in self._waiting if isinstance(one, TransactionResult)]
        self._waiting = deque([*again, *results][-RESULTS_KEPT:])
        self._taken = taken
        self._takes = frozenset(takes)
        for handler in self._handlers:
            handler.resend()

    def link_down(self) -> None:
        """No tower is connected."""
        self._taken = False
        # Kept as not sent: the time until the next link must not count.
        again = [result for at, result in self._sent if self._now - at <= AGAIN_WITHIN_S]
        self._sent.clear()
        self._waiting.extendleft(reversed(again))

    # Requests of the tower.

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """Starts a transaction. The latest known epoch was announced through `epoch_changed`."""
        handler = self._handler_of.get(type(transaction.work))
        if handler is None:
            self.refuse(transaction.id, Outcome.REFUSED, "The agent on this drone is too old for that.")
        elif isinstance(transaction.work, WRITES) and transaction.epoch < self._epoch:
            words = "The controls have changed hands since this request."
            self.refuse(transaction.id, Outcome.STALE_EPOCH, words)
        else:
            self._forget(transaction.id)
            self._going_on[transaction.id] = transaction.trace
            if transaction.trace:
                _log.info(
                    "request %s: transaction %d begins: %s", transaction.trace, transaction.id, _named(transaction)
                )
            handler.begin(transaction, around, now)

    def refuse(self, transaction_id: int, outcome: Outcome, words: str) -> None:
        """Reports a result without starting the transaction."""
        self._forget(transaction_id)
        self._wait(TransactionResult(id=transaction_id, outcome=outcome, words=words))

    def cancel(self, transaction_id: int, now: float) -> None:
        """The tower cancels a transaction, or asks for its result."""
        ended = [*(one for _, one in self._sent), *self._waiting]
        if transaction_id in self._going_on:
            for handler in self._handlers:
                handler.cancel(transaction_id, now)
        elif not any(isinstance(one, TransactionResult) and one.id == transaction_id for one in ended):
            self._wait(TransactionResult(id=transaction_id, outcome=Outcome.REFUSED, words=NOT_HERE))

    def epoch_changed(self, epoch: int, now: float) -> None:
        """Sets the current epoch, which may be lower on a new link. Ignores a repeated one."""
        if epoch == self._epoch:
            return
        self._epoch = epoch
        for handler in self._handlers:
            handler.epoch_changed(epoch, now)

    @property
    def busy(self) -> bool:
        """Whether a transaction of the tower is in progress."""
        return bool(self._going_on)

    # The autopilot.

    def autopilot_came(self, around: Around, now: float) -> None:
        """The autopilot is heard for the first time, or again after a silence, or has rebooted."""
        for handler in self._handlers:
            handler.autopilot_came(around, now)

    def receive(self, frame: bytes, now: float) -> bool:
        """Takes a frame of a type in `hears`. True: it answers one handler alone and need not go to the tower."""
        msgid = message_id(frame)
        answers = [handler.receive(frame, now) for handler in self._handlers if msgid in handler.hears]
        return any(answers)

    def due(self, around: Around | None, now: float) -> list[bytes]:
        """Returns the frames to send to the autopilot now. `around` is None if no autopilot was heard yet."""
        self._now = now
        if around is None:
            return []
        return [frame for handler in self._handlers for frame in handler.due(around, now)]

    # Messages to the tower.

    def reports(self, *, room: int = MAX_WAITING) -> list[TransactionToTower]:
        """Returns messages for the control channel, in order, at most `room`; none without a tower that takes them."""
        for handler in self._handlers:
            for one in handler.reports():
                self._wait(one)
        if len(self._waiting) > MAX_WAITING:
            self._throw_state_away()
        if not self._taken:
            return []
        sending = [self._waiting.popleft() for _ in range(min(room, len(self._waiting)))]
        self._sent.extend((self._now, one) for one in sending if isinstance(one, TransactionResult))
        return sending

    def _wait(self, reports: TransactionToTower) -> None:
        if isinstance(reports, TransactionResult):
            trace = self._going_on.pop(reports.id, "")
            if trace:
                ended = reports.outcome.value
                _log.info("request %s: transaction %d ends: %s. %s", trace, reports.id, ended, reports.words)
        for one in [one for one in self._waiting if _says_more(reports, one)]:
            self._waiting.remove(one)
        if isinstance(reports, MetadataToTower) and PARAMETER_METADATA not in self._takes:
            return
        if isinstance(reports, TargetFound) and (SIGHTINGS if reports.sighting else FINDINGS) not in self._takes:
            return
        if isinstance(reports, ControllerDescribed) and CONTROLLER_SETTINGS not in self._takes:
            return
        if self._taken or isinstance(reports, TransactionResult):
            self._waiting.append(reports)

    def _throw_state_away(self) -> None:
        results = [one for one in self._waiting if isinstance(one, TransactionResult)]
        self._waiting = deque(results[-RESULTS_KEPT:])
        for handler in self._handlers:
            handler.resend()

    def _forget(self, transaction_id: int) -> None:
        """Forgets an earlier transaction of this id: a restarted tower may count from the beginning."""
        self._sent = deque((sending for sending in self._sent if sending[1].id != transaction_id), RESULTS_KEPT)
        self._waiting = deque(one for one in self._waiting if getattr(one, "id", None) != transaction_id)


def _says_more(reports: TransactionToTower, waiting: TransactionToTower) -> bool:
    """Whether `reports` makes a queued message obsolete."""
    if isinstance(waiting, TransactionProgress):
        return isinstance(reports, TransactionProgress | TransactionResult) and reports.id == waiting.id
    if isinstance(waiting, TargetFound):
        return waiting.sighting and isinstance(reports, TargetFound) and reports.sighting
    return isinstance(waiting, PlanOnBoard) and isinstance(reports, PlanOnBoard) and reports.kind == waiting.kind


def _named(transaction: Transaction) -> str:
    work = transaction.work
    return f"MAV_CMD {work.command}" if isinstance(work, CommandWork) else type(work).__name__.removesuffix("Work")
