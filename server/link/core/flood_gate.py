"""Rate limits by user, and by drone and direction. Excess frames are dropped, counted and reported.

The limits are far above what people and programs need (sticks at 50 Hz, a mission in one burst, 1,500 parameters
requested one by one) and far below what hurts. Each user has one account for all sockets. Each drone has two accounts
downwards, one for the pilot and one for all readers, so that a flood cannot take the sticks from the pilot: the last
quarter of a user's account is for flying alone. Sans-I/O: takes `now`.
"""

from collections.abc import Container
from dataclasses import dataclass
from typing import Final

from server.kernel.shares import ShareName, Shares
from server.link.core.token_bucket import TokenBucket
from wire.ids import DroneId, UserId
from wire.state_messages import state_key

FLOODING: Final = 4429
"""Closes a socket that continues after a warning."""

RESERVED: Final = 0.25
"""Share of an account reserved for what must not be lost."""

PATIENCE: Final = 5_000
PATIENCE_PER_S: Final = 50.0
"""Refused messages that a socket may send before it is closed, and how fast that is forgotten."""

REQUESTS_PER_S: Final = 20.0
REQUESTS_BURST: Final = 200
"""Text messages of a browser: pongs twice a second, a map that is dragged about, a page that is opened."""

OPENINGS_AT_ONCE: Final = 4
OPENINGS_REFILLED_IN_S: Final = 10.0
"""All tabs of a user may come back four times in a row after a network that flickers, and once every ten seconds."""

OPERATIONS_REFILLED_IN_S: Final = 10.0
"""What a user has done at drones over REST: each goes to an agent, to all who watch, and into the trail."""

RECORDINGS_PER_S: Final = 0.5
"""Recordings that a user begins: a squad at once. Each is a row, a thread, a process that makes its file, and a line in
the trail."""

REPORTS_PER_S: Final = 50.0
REPORTS_BURST: Final = 500
"""Messages of an agent about itself: a few a second while it holds, each in several copies."""


LIMITED_REPORTS_PER_S: Final = 10.0
LIMITED_REPORTS_BURST: Final = 100
"""The same of a drone that is limited."""


@dataclass(frozen=True)
class FloodLimits:
    """Frames in a second for long, and at once (docs/settings.md)."""

    user_per_s: int = 500
    user_burst: int = 4_000
    drone_per_s: int = 300
    drone_burst: int = 3_000
    agent_per_s: int = 10_000
    agent_burst: int = 20_000


class FloodGate:
    """One for the hub."""

    def __init__(self, limits: FloodLimits, shares: Shares | None = None) -> None:
        self._limits = limits
        self._shares = shares or Shares()
        self._by_share: dict[ShareName, int] = {}
        """The limits by which the accounts of each share were made."""
        self._agents_reserve = RESERVED * limits.agent_burst
        self._users: dict[UserId, TokenBucket] = {}
        self._flying: dict[DroneId, TokenBucket] = {}
        self._reading: dict[DroneId, TokenBucket] = {}
        self._agents: dict[DroneId, TokenBucket] = {}
        self._reports: dict[DroneId, TokenBucket] = {}
        self._limited_reports: dict[DroneId, TokenBucket] = {}
        self._openings: dict[UserId, TokenBucket] = {}
        self._video_openings: dict[UserId, TokenBucket] = {}
        self._operations: dict[UserId, TokenBucket] = {}
        self._stops: dict[UserId, TokenBucket] = {}
        self._recordings: dict[UserId, TokenBucket] = {}

    def admits(self, user_id: UserId, drone_id: DroneId | None, *, flies: bool, now: float) -> bool:
        """Accounts for one frame of a user. `drone_id`: its target, None if there is none; `flies`: the sender has the
        turn there."""
        limits = self._limits
        account = self._users.get(user_id)
        if account is None:
            account = self._users[user_id] = TokenBucket(limits.user_per_s, limits.user_burst, now)
        if not account.take(1.0, now, leave=0.0 if flies else RESERVED * limits.user_burst):
            return False
        if drone_id is None:
            return True
        way = self._flying if flies else self._reading
        bucket = way.get(drone_id)
        if bucket is None:
            bucket = way[drone_id] = TokenBucket(limits.drone_per_s, limits.drone_burst, now)
        return bucket.take(1.0, now)

    def admits_all(self, drone_id: DroneId, count: int, now: float) -> bool:
        """Whether all frames of an agent's datagram may pass, without looking at them: nearly always. If not,
        `admitted` selects."""
        bucket = self._agents.get(drone_id)
        if bucket is None:
            limits = self._limits
            bucket = self._agents[drone_id] = TokenBucket(limits.agent_per_s, limits.agent_burst, now)
        return bucket.take(count, now, leave=self._agents_reserve)

    def admitted(self, drone_id: DroneId, frames: list[bytes], now: float) -> tuple[list[bytes], int, int]:
        """Selects the frames of a refused datagram that may pass, and counts the dropped ones: (state, transactional).
        State is dropped first, because the next frame repeats it."""
        bucket = self._agents[drone_id]
        transactional = [frame for frame in frames if state_key(frame) is None]
        kept = [frame for frame in transactional if bucket.take(1.0, now)]
        return kept, len(frames) - len(transactional), len(transactional) - len(kept)

    def admits_opening(self, user_id: UserId, now: float, *, most_open: int, video: bool = False) -> bool:
        """Accounts for another live or video connection of a user. `most_open` may be open at the same time: each
        begins with the whole state, so opening and closing connections is a flood too."""
        openings = self._video_openings if video else self._openings
        bucket = openings.get(user_id)
        if bucket is None:
            per_s, at_once = most_open / OPENINGS_REFILLED_IN_S, most_open * OPENINGS_AT_ONCE
            bucket = openings[user_id] = TokenBucket(per_s, at_once, now)
        return bucket.take(1.0, now)

    def admits_operation(self, user_id: UserId, now: float, *, stops: bool) -> bool:
        """Accounts for another operation of a user. `stops`: it ends a flight or an operation, and has an account of
        its own, so that stopping works even after too many requests."""
        burst = self._limit(ShareName.OPERATIONS, self._operations, self._stops)
        accounts = self._stops if stops else self._operations
        bucket = accounts.get(user_id)
        if bucket is None:
            bucket = accounts[user_id] = TokenBucket(burst / OPERATIONS_REFILLED_IN_S, burst, now)
        self._shares.note(ShareName.OPERATIONS, user_id)
        return bucket.take(1.0, now)

    def admits_recording(self, user_id: UserId, now: float) -> bool:
        """One more recording that a user begins."""
        burst = self._limit(ShareName.RECORDINGS, self._recordings)
        bucket = self._recordings.get(user_id)
        if bucket is None:
            bucket = self._recordings[user_id] = TokenBucket(RECORDINGS_PER_S, burst, now)
        self._shares.note(ShareName.RECORDINGS, user_id)
        return bucket.take(1.0, now)

    def _limit(self, name: ShareName, *accounts: dict[UserId, TokenBucket]) -> int:
        """The limit of a share. When an admin changes it, everybody begins anew."""
        limit = self._shares.limit(name)
        if self._by_share.setdefault(name, limit) != limit:
            self._by_share[name] = limit
            for one in accounts:
                one.clear()
        return limit

    def admits_report(self, drone_id: DroneId, now: float, *, limited: bool = False) -> bool:
        """One message of an agent's control channel, or an urgent one."""
        reports = self._limited_reports if limited else self._reports
        bucket = reports.get(drone_id)
        if bucket is None:
            per_s = LIMITED_REPORTS_PER_S if limited else REPORTS_PER_S
            burst = LIMITED_REPORTS_BURST if limited else REPORTS_BURST
            bucket = reports[drone_id] = TokenBucket(per_s, burst, now)
        return bucket.take(1.0, now)

    def forget_idle(self, drones: Container[DroneId], now: float) -> None:
        """Once a second: users who have long sent nothing, and drones that are no more, need no memory."""
        for users in self._by_user():
            for user_id in [one for one, bucket in users.items() if bucket.is_full(now)]:
                del users[user_id]
        for way in self._by_drone():
            for drone_id in [one for one in way if one not in drones]:
                del way[drone_id]

    def __len__(self) -> int:
        return sum(len(users) for users in self._by_user()) + sum(len(way) for way in self._by_drone())

    def _by_drone(self) -> tuple[dict[DroneId, TokenBucket], ...]:
        return self._flying, self._reading, self._agents, self._reports, self._limited_reports

    def _by_user(self) -> tuple[dict[UserId, TokenBucket], ...]:
        accounts = (self._users, self._operations, self._stops, self._recordings)
        return (*accounts, self._openings, self._video_openings)
