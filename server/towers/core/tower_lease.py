"""Which process is the tower: the rules of the lock on a database. Time is passed in; no wall clock is used.

The row of the lock holds a random owner and a counter. Its owner increments the counter; a waiting process watches it.
Each side measures durations with its own clock: an owner trusts its lock for `LEASE_S` from the moment at which it
*began* to renew it; a waiting process takes it `TAKE_AFTER_S` after it last *saw* a change, which is later.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Final

RENEW_EVERY_S: Final = 0.5
RENEW_WITHIN_S: Final = 1.0
"""Timeout of a renewal. Two of them and the pause between them are shorter than the lease."""
LEASE_S: Final = 3.0
TAKE_AFTER_S: Final = 3.3
"""The lease, plus a tenth for clocks of different speed."""
CHECK_EVERY_S: Final = 0.25
WATCHED_FOR_S: Final = 3.0
"""A process counts as waiting for the lock for this long after its last check."""
HOLD_AFTER_S: Final = 2.0
"""An owner that has not renewed its lock for this long, while another process waits for it, orders drones flown by hand
to hold: a second before it stops forwarding (`LEASE_S`), and longer before another process may be the tower."""

AWAY_S: Final = 6.0
"""After a pause as long as this, requests in the sockets may be old, and a command of flight must not be executed late:
they are refused."""

NOBODY: Final = ""
BUS: Final = "bus"
"""The owner of a lock while several towers that share a bus have the database."""


@dataclass(frozen=True)
class LockState:
    """The row as read. `taken_at` and `renewed_at` are for people only. `owner` is NOBODY for a free lock."""

    owner: str
    renewals: int
    host: str = ""
    pid: int = 0
    address: str = ""
    taken_at: datetime | None = None
    renewed_at: datetime | None = None

    @property
    def is_free(self) -> bool:
        return self.owner == NOBODY

    def in_words(self) -> str:
        if self.owner == BUS:
            return "several towers that share a bus (TOWER_BUS_URL)"
        since = f", since {self.taken_at:%Y-%m-%d %H:%M:%S} UTC" if self.taken_at else ""
        at = f", at {self.address}" if self.address else ""
        return f"process {self.pid} on {self.host}{since}{at}"


class LockWatch:
    """What a waiting process concludes from the row. One instance for each attempt to become the tower."""

    def __init__(self) -> None:
        self._seen: tuple[str, int] | None = None
        self._since = 0.0
        self.is_alive = False
        """Whether the lock was renewed, or changed hands, while this process watched."""

    def may_take(self, state: LockState, now: float) -> bool:
        """Whether the lock may be taken from its owner, after reading `state` at `now` (seconds of a clock that also
        runs while the machine sleeps)."""
        seen = (state.owner, state.renewals)
        if self._seen is not None and seen != self._seen:
            self.is_alive = True
        if seen != self._seen:
            self._seen, self._since = seen, now
        return state.is_free or now - self._since >= TAKE_AFTER_S

    def unanswered(self) -> None:
        """The database could not be read or written, so its owner could not renew the lock either."""
        self._seen = None


class LockBelief:
    """Whether an owner may still trust its own lock."""

    def __init__(self, began_at: float) -> None:
        self._as_of = began_at
        self._looks: int | None = None
        self._checked_at = float("-inf")
        self.is_lost = False

    def renewed(self, began_at: float, looks: int = 0) -> None:
        """The database has renewed the lock in an attempt that began then. `looks`: of the row."""
        self._as_of = max(self._as_of, began_at)
        if self._looks is not None and looks != self._looks:
            self._checked_at = began_at
        self._looks = looks

    @property
    def is_watched(self) -> bool:
        """Whether another process waited for the lock when it was last renewed."""
        return self._as_of - self._checked_at < WATCHED_FOR_S

    def is_unsure(self, now: float) -> bool:
        """Whether requests wait for a renewal that would bring an owner back whose lease has run out: as far as it
        knows, nobody else wants to be the tower, and it has not been away for long."""
        return not self.is_lost and not self.is_watched and self.silent_for_s(now) < AWAY_S

    def unanswered(self, began_at: float) -> None:
        """The database did not respond to an attempt that began then. If no process waits for the lock, the owner
        continues, so that pilots keep flying. If one waits, it may reach the database when the owner cannot, and the
        lease runs out. It also runs out for an owner that was stopped: it must check whether another has taken the
        lock."""
        if self.may_act(began_at) and not self.is_watched:
            self._as_of = max(self._as_of, began_at)

    def must_hold(self, now: float) -> bool:
        """Whether drones flown by hand must hold: the lease is about to run out."""
        return self.is_watched and self.silent_for_s(now) >= HOLD_AFTER_S

    def silent_for_s(self, now: float) -> float:
        return now - self._as_of

    def may_act(self, now: float) -> bool:
        """False once another process may have taken the lock: this process was stopped, and has not checked since."""
        return not self.is_lost and now - self._as_of < LEASE_S
