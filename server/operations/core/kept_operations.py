"""Which operations are kept, and for how long: those that can be requested, and those given up.

Bounded: 1,000 that have ended, for an hour at most; 50 whose end an agent may still report.
"""

from collections import OrderedDict
from dataclasses import replace
from typing import Final

from server.operations.core.operation import Operation

MAX_ENDED: Final = 1000
MAX_LATE: Final = 50
ENDED_KEPT_S: Final = 3600.0


class KeptOperations:
    """In the order of their beginning."""

    def __init__(self) -> None:
        self._named: OrderedDict[int, Operation] = OrderedDict()
        """All that can be requested, by number."""
        self._late: OrderedDict[int, Operation] = OrderedDict()
        """Given up; by transaction."""

    def add(self, operation: Operation) -> None:
        """A requested operation, whose progress can be requested."""
        self._named[operation.id] = operation

    def find(self, operation_id: int) -> Operation | None:
        """One that runs, or that has ended not long ago."""
        return self._named.get(operation_id)

    def late(self, transaction_id: int) -> Operation | None:
        """The operation that was given up at this transaction."""
        return self._late.get(transaction_id)

    def add_late(self, operation: Operation) -> None:
        """It is given up: its agent may still report the end."""
        self._late[operation.transaction_id] = operation
        while len(self._late) > MAX_LATE:
            _, oldest = self._late.popitem(last=False)
            _forget_work(oldest)

    def end_late(self, transaction_id: int) -> None:
        """Its end was reported. Harmless of any other."""
        self._late.pop(transaction_id, None)

    def ended(self, operation: Operation) -> None:
        """It is over: what it was to do is kept only while its end may still be put right."""
        if operation.transaction_id not in self._late:
            _forget_work(operation)

    def forget_old(self, now: float, *, running: int) -> None:
        """`running`: how many are not over."""
        while self._named:
            oldest = next(iter(self._named.values()))
            too_many = len(self._named) - running > MAX_ENDED
            if oldest.running or not (too_many or now - oldest.ended_s > ENDED_KEPT_S):
                break
            self._named.popitem(last=False)


def _forget_work(operation: Operation) -> None:
    """A thousand that are over must not keep a thousand plans."""
    operation.order = replace(operation.order, steps=())
