"""Writes the journal in a thread: a memory card may take a second, and stick input must not wait."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from onboard_agent.transactions.journal import JournalStore, Lasting
from wire.plans import PlanKind


class JournalThread:
    """A JournalStore. Runs one change after another, in the order of the calls, and caches the records on disk."""

    def __init__(self, files: JournalStore) -> None:
        self._files = files
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="journal")
        self._records: dict[PlanKind, bytes | None] = {}

    def load(self, kind: PlanKind) -> bytes | None:
        """Returns the record as of the last completed change; reads the disk the first time. Raises OSError."""
        if kind not in self._records:
            self._records[kind] = self._files.load(kind)
        return self._records[kind]

    def save(self, kind: PlanKind, record: bytes) -> Lasting:
        """Starts the save."""
        return self._begin(kind, record, lambda: self._files.save(kind, record))

    def remove(self, kind: PlanKind) -> Lasting:
        """Starts the removal."""
        return self._begin(kind, None, lambda: self._files.remove(kind))

    def _begin(self, kind: PlanKind, record: bytes | None, change: Callable[[], Any]) -> Lasting:
        future: Future[Any] = self._worker.submit(change)

        def lasting() -> bool:
            if not future.done():
                return False
            future.result()
            self._records[kind] = record
            return True

        return lasting
