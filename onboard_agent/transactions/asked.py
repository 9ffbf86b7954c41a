"""A transaction in progress: its deadline, and its progress reports. No I/O; takes `now`."""

from typing import Any, Final

from wire.transactions import Outcome, Transaction, TransactionProgress, TransactionResult

PROGRESS_EVERY_S: Final = 0.2


class Asked:
    """`deadline`: on the clock of `now`."""

    def __init__(self, transaction: Transaction, now: float) -> None:
        self.id = transaction.id
        self.epoch = transaction.epoch
        self.deadline = now + transaction.deadline_s
        self._sent_at = float("-inf")

    def progress(self, phase: str, done: int, total: int, now: float) -> list[TransactionProgress]:
        """The progress to report now: none if it was just reported."""
        if now - self._sent_at < PROGRESS_EVERY_S:
            return []
        self._sent_at = now
        return [TransactionProgress(id=self.id, phase=phase, done=done, total=total)]

    def result(self, outcome: Outcome, words: str, **more: Any) -> TransactionResult:
        """The last report about it."""
        return TransactionResult(id=self.id, outcome=outcome, words=words, **more)
