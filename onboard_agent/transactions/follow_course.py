"""Where a follower flies, and when it must not follow any more. Pure: positions in, a place or a reason out.

Laws, each with a test:
- No place that is commanded is within NEAR_M of where the leader is taken to be, over ground and in height.
- What is not fresh is not followed, and nothing is moved on in thought for longer than that.
- Heights are above the sea: the two drones need not have the same home. They agree as well as their own heights do.
"""

from math import cos, hypot, radians
from typing import Final, NamedTuple

from wire.following import FARTHEST_M, NEAR_M, FollowWork, is_apart

STALE_S: Final = 2.0
"""A position older than this, the leader's or one's own, is no position."""

AHEAD_S: Final = 1.0
"""So far ahead the two are moved on as they fly, to see whether they come too near."""

LOWEST_M: Final = 3.0
"""Above the follower's home: a leader that comes down does not fly its followers into the ground."""

_METRES_PER_E7: Final = 0.011_131_95
_ROUND_E7: Final = 3_600_000_000


class Motion(NamedTuple):
    """Degrees times 10^7, metres above the sea, metres a second, and when that was so (`now`'s clock)."""

    lat_e7: float
    lon_e7: float
    alt_m: float
    north_m_s: float
    east_m_s: float
    down_m_s: float
    at: float

    def fresh(self, now: float, within_s: float = STALE_S) -> bool:
        return now - self.at <= within_s

    def later(self, now: float) -> "Motion":
        """Moved on as it flies, for STALE_S at the most."""
        seconds = min(max(0.0, now - self.at), STALE_S)
        moved = self.shifted(self.north_m_s * seconds, self.east_m_s * seconds, -self.down_m_s * seconds)
        return moved._replace(at=now)

    def shifted(self, north_m: float, east_m: float, up_m: float) -> "Motion":
        """So much further on, flying as before."""
        lat_e7 = self.lat_e7 + north_m / _METRES_PER_E7
        lon_e7 = self.lon_e7 + east_m / (_METRES_PER_E7 * _shrunk(self.lat_e7))
        return self._replace(
            lat_e7=lat_e7,
            lon_e7=(lon_e7 + _ROUND_E7 / 2) % _ROUND_E7 - _ROUND_E7 / 2,
            alt_m=self.alt_m + up_m,
        )


class Gap(NamedTuple):
    """How far one is from another, metres."""

    over_ground_m: float
    in_height_m: float

    @property
    def near(self) -> bool:
        return self.over_ground_m < NEAR_M and self.in_height_m < NEAR_M


def gap(one: Motion, other: Motion) -> Gap:
    """Between the places as they are, on a flat piece of earth: good for some kilometres, poles apart."""
    lon_e7 = (other.lon_e7 - one.lon_e7 + _ROUND_E7 / 2) % _ROUND_E7 - _ROUND_E7 / 2
    north_m = (other.lat_e7 - one.lat_e7) * _METRES_PER_E7
    return Gap(hypot(north_m, lon_e7 * _METRES_PER_E7 * _shrunk(one.lat_e7)), abs(other.alt_m - one.alt_m))


def place(leader: Motion, work: FollowWork, now: float) -> Motion:
    """The follower's, and how fast it moves."""
    return leader.later(now).shifted(work.north_m, work.east_m, work.up_m)


def why_not_there(work: FollowWork) -> str | None:
    """Why such a position cannot be kept, or None."""
    if is_apart(work.north_m, work.east_m, work.up_m):
        return None
    return f"the place is too near to {work.leader_name}"


def why_stop(own: Motion, leader: Motion, work: FollowWork, now: float, *, home_alt_m: float) -> str | None:
    """Why it must hold now, in words, or None. `home_alt_m`: of its own home, above the sea."""
    name = work.leader_name
    if not leader.fresh(now, work.patience_s):
        return f"nothing new was heard of {name} for {work.patience_s:g} s"
    if not own.fresh(now):
        return f"the autopilot has not said for {STALE_S:g} s where it is"
    here, there = own.later(now), leader.later(now)
    apart = gap(here, there)
    if apart.near or gap(here.later(now + AHEAD_S), there.later(now + AHEAD_S)).near:
        return f"it came too near to {name} ({apart.over_ground_m:.0f} m away, {apart.in_height_m:.0f} m in height)"
    if max(apart) > FARTHEST_M:
        return f"{name} is more than {FARTHEST_M:g} m away: too fast to be followed, or the way was barred"
    if place(leader, work, now).alt_m - home_alt_m < LOWEST_M:
        return f"behind {name} it would come lower than {LOWEST_M:g} m above its home"
    return None


def _shrunk(lat_e7: float) -> float:
    """Metres of a degree of longitude at this latitude; never zero, not even at a pole."""
    return max(0.01, cos(radians(lat_e7 / 1e7)))
