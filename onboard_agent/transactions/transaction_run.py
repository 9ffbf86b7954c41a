"""A transaction in progress, with its deadline and progress reports. No I/O; takes `now`."""

from typing import Any, Final

from wire.transactions import Outcome, Transaction, TransactionProgress, TransactionResult

PROGRESS_EVERY_S: Final = 0.2


class TransactionRun:
    """`deadline` uses the clock of `now`."""

    def __init__(self, transaction: Transaction, now: float) -> None:
        self.id = transaction.id
        self.epoch = transaction.epoch
        self.deadline = now + transaction.deadline_s
        self._sent_at = float("-inf")

    def progress(self, phase: str, done: int, total: int, now: float) -> list[TransactionProgress]:
        """Returns the progress to report now, or nothing within PROGRESS_EVERY_S of the last report."""
        if now - self._sent_at < PROGRESS_EVERY_S:
            return []
        self._sent_at = now
        return [TransactionProgress(id=self.id, phase=phase, done=done, total=total)]

    def result(self, outcome: Outcome, words: str, **more: Any) -> TransactionResult:
        """Returns the final report of the transaction."""
        return TransactionResult(id=self.id, outcome=outcome, words=words, **more)
