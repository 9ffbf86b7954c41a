"""Order of password hashes: threads are few, and each hash takes tens of megabytes. Pure.

Known addresses go first and have reserved threads. Next come strangers whose network has no wrong guesses, newest
first: a network has two such tries, and an earlier flood of them does not delay a newcomer. Then all others, in turns
by network.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

from server.anonymous.core.fair_queue import Bounds, FairQueue, Priority, Ticket
from server.anonymous.core.limits import AnonymousLimits
from server.anonymous.core.networks import Origin

T = TypeVar("T")


@dataclass(frozen=True)
class Caller:
    """For whom a password is hashed."""

    origin: Origin
    standing: Priority


@dataclass(frozen=True)
class Place(Generic[T]):
    """`ticket` None: no place in the queue. Notify `pushed_out` that it waits in vain."""

    ticket: Ticket[T] | None
    pushed_out: Ticket[T] | None


class HashingSlots(Generic[T]):
    """`ask` for a slot, `next` for who may begin now, `done` when one has ended."""

    def __init__(self, slots: int, limits: AnonymousLimits) -> None:
        bounds = Bounds(
            limits.max_waiting_hashes_per_address, limits.max_waiting_hashes_per_network, limits.max_waiting_hashes
        )
        self._line = FairQueue[T](bounds, newest_first=Priority.FRESH)
        self._slots = slots
        self._for_strangers = max(1, slots - limits.known_hash_slots)
        self._busy = 0
        self._strangers = 0

    @property
    def waiting(self) -> int:
        return len(self._line)

    def ask(self, item: T, caller: Caller) -> Place[T]:
        return Place(*self._line.join(item, caller.origin, caller.standing))

    def next(self) -> Ticket[T] | None:
        """Who may begin now; their slot is taken."""
        if self._busy >= self._slots:
            return None
        worst = Priority.SUSPECT if self._strangers < self._for_strangers else Priority.KNOWN
        ticket = self._line.call(worst)
        if ticket is not None:
            self._busy += 1
            self._strangers += ticket.standing is not Priority.KNOWN
        return ticket

    def done(self, ticket: Ticket[T]) -> None:
        self._busy -= 1
        self._strangers -= ticket.standing is not Priority.KNOWN

    def leave(self, ticket: Ticket[T]) -> None:
        """It waits no longer."""
        self._line.leave(ticket)
