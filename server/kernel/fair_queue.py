"""A queue that several share: each has a share of its own, and they are served in turns. Pure.

Whoever puts in too much loses the oldest of its own, and never delays or displaces what is another's.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Hashable
from typing import Generic, TypeVar

K = TypeVar("K", bound=Hashable)
T = TypeVar("T")


class FairQueue(Generic[K, T]):
    """`share`: how much of one may wait; it may change, and counts for what comes."""

    def __init__(self, share: int) -> None:
        self.share = share
        self._waiting: OrderedDict[K, deque[T]] = OrderedDict()
        """Whose turn was longest ago comes first."""
        self._count = 0
        self.dropped = 0

    def __len__(self) -> int:
        return self._count

    def waiting(self, whose: K) -> int:
        """How much of this one waits."""
        return len(self._waiting.get(whose, ()))

    def all_waiting(self) -> dict[K, int]:
        """How much waits of each."""
        return {whose: len(queue) for whose, queue in self._waiting.items()}

    def put(self, whose: K, item: T) -> None:
        """Where the share is full, the oldest of the same one is dropped."""
        queue = self._waiting.setdefault(whose, deque())
        while len(queue) >= self.share:
            queue.popleft()
            self._count -= 1
            self.dropped += 1
        queue.append(item)
        self._count += 1

    def pop(self) -> tuple[K, T]:
        """The oldest of the one whose turn it is. Raises KeyError."""
        whose, queue = self._waiting.popitem(last=False)
        item = queue.popleft()
        self._count -= 1
        if queue:
            self._waiting[whose] = queue
        return whose, item
