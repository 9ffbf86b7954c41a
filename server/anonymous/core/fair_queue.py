"""A bounded line in which networks take turns, however many requests each of them sends. Pure.

Start-time fair queueing: a ticket's number is one more than that of the last ticket of the same network, and never less
than the number that was served last. A network that sends a thousand requests is served as often as one that sends two.
Better standing goes first; where the line is full, a better one takes the place of the worst.
"""

from __future__ import annotations

import heapq
from collections import Counter
from dataclasses import dataclass
from enum import IntEnum
from typing import Generic, TypeVar

from server.anonymous.core.networks import Origin

T = TypeVar("T")


class Priority(IntEnum):
    """Who is served first."""

    KNOWN = 0
    """Has signed in from there before, or is signed in."""
    FRESH = 1
    """Nothing is known of them."""
    SUSPECT = 2
    """From a network with wrong guesses."""


@dataclass(eq=False, slots=True)
class Ticket(Generic[T]):
    """A place in the line. `waiting` until it is called, left, or pushed out."""

    item: T
    origin: Origin
    standing: Priority
    number: int
    waiting: bool = True


@dataclass(frozen=True)
class Bounds:
    per_address: int
    per_network: int
    total: int
    known_factor: int = 1
    """Multiplies the places of a known address."""


class FairQueue(Generic[T]):
    """`join`, then `call` for the next one. `leave` removes one that no longer waits."""

    def __init__(self, bounds: Bounds, *, newest_first: Priority | None = None) -> None:
        """`newest_first`: within this priority the newest is next. If more arrive than can be served, some wait in vain
        in any order; this way not all of them do."""
        self._newest_first = newest_first
        self._bounds = bounds
        self._heap: list[tuple[int, int, int, Ticket[T]]] = []
        self._served = 0
        self._joined = 0
        self._last: dict[str, int] = {}
        self._of: Counter[str] = Counter()
        self._waiting = 0

    def __len__(self) -> int:
        return self._waiting

    def join(self, item: T, origin: Origin, standing: Priority) -> tuple[Ticket[T] | None, Ticket[T] | None]:
        """(the place, who was pushed out for it). No place: address, network, or the whole line has too many."""
        bounds = self._bounds
        factor = bounds.known_factor if standing is Priority.KNOWN else 1
        if self._of[f"a {origin.address}"] >= bounds.per_address * factor:
            return None, None
        if standing is not Priority.KNOWN and self._of[f"n {origin.network}"] >= bounds.per_network:
            return None, None
        pushed_out = None
        if self._waiting >= bounds.total:
            pushed_out = self._worst()
            if pushed_out is None or pushed_out.standing <= standing:
                return None, None
            self.leave(pushed_out)
        number = max(self._served, self._last.get(origin.network, 0)) + 1
        self._last[origin.network] = number
        self._joined += 1
        ticket = Ticket(item, origin, standing, number)
        place = -self._joined if standing is self._newest_first else number
        heapq.heappush(self._heap, (standing, place, self._joined, ticket))
        self._count(origin, 1)
        return ticket, pushed_out

    def call(self, worst: Priority = Priority.SUSPECT) -> Ticket[T] | None:
        """Removes and returns the next ones of at least this priority."""
        while self._heap and not self._heap[0][3].waiting:
            heapq.heappop(self._heap)
        if not self._heap or self._heap[0][3].standing > worst:
            return None
        ticket = heapq.heappop(self._heap)[3]
        self._served = max(self._served, ticket.number)
        self._gone(ticket)
        return ticket

    def leave(self, ticket: Ticket[T]) -> None:
        """Harmless for one that waits no longer."""
        if ticket.waiting:
            self._gone(ticket)
            if len(self._heap) > 2 * self._waiting + 16:
                self._heap = [entry for entry in self._heap if entry[3].waiting]
                heapq.heapify(self._heap)

    def _gone(self, ticket: Ticket[T]) -> None:
        ticket.waiting = False
        self._count(ticket.origin, -1)

    def _count(self, origin: Origin, by: int) -> None:
        self._waiting += by
        for key in (f"a {origin.address}", f"n {origin.network}"):
            self._of[key] += by
            if not self._of[key]:
                del self._of[key]
        if f"n {origin.network}" not in self._of and self._last.get(origin.network, 0) <= self._served:
            self._last.pop(origin.network, None)
        if not self._waiting:
            self._last.clear()

    def _worst(self) -> Ticket[T] | None:
        waiting = (entry for entry in self._heap if entry[3].waiting)
        return max(waiting, key=lambda entry: entry[:3], default=(0, 0, 0, None))[3]
