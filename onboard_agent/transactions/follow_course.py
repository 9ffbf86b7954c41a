"""Computes where a follower flies, and when it must stop following. Pure.

Rules, each tested:
- No commanded position is within NEAR_M of the leader's estimated position, both over ground and in height.
- A stale position is not followed, and no position is extrapolated for longer than STALE_S.
- Heights are above sea level, so that the two drones need not share a home. They are as accurate as each drone's own.
"""

from math import cos, hypot, radians
from typing import Final, NamedTuple

from wire.following import FARTHEST_M, NEAR_M, FollowWork, is_apart

STALE_S: Final = 2.0
"""Positions older than this are ignored, both the leader's and the follower's own."""

AHEAD_S: Final = 1.0
"""Both drones' motion is extrapolated this far, to check whether they come too near."""

LOWEST_M: Final = 3.0
"""Above the follower's home, so that a descending leader does not fly its followers into the ground."""

_METRES_PER_E7: Final = 0.011_131_95
_ROUND_E7: Final = 3_600_000_000


class Motion(NamedTuple):
    """Degrees times 10^7, metres above sea level, metres per second, and the measurement time (clock of `now`)."""

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
        """Extrapolates the motion to `now`, by STALE_S at most."""
        seconds = min(max(0.0, now - self.at), STALE_S)
        moved = self.shifted(self.north_m_s * seconds, self.east_m_s * seconds, -self.down_m_s * seconds)
        return moved._replace(at=now)

    def shifted(self, north_m: float, east_m: float, up_m: float) -> "Motion":
        """Returns the position moved by this offset, with the same velocity."""
        lat_e7 = self.lat_e7 + north_m / _METRES_PER_E7
        lon_e7 = self.lon_e7 + east_m / (_METRES_PER_E7 * _shrunk(self.lat_e7))
        return self._replace(
            lat_e7=lat_e7,
            lon_e7=(lon_e7 + _ROUND_E7 / 2) % _ROUND_E7 - _ROUND_E7 / 2,
            alt_m=self.alt_m + up_m,
        )


class Gap(NamedTuple):
    """Distance between two positions, in metres."""

    over_ground_m: float
    in_height_m: float

    @property
    def near(self) -> bool:
        return self.over_ground_m < NEAR_M and self.in_height_m < NEAR_M


def gap(one: Motion, other: Motion) -> Gap:
    """Computes the distance on a flat earth: accurate for some kilometres, except near the poles."""
    lon_e7 = (other.lon_e7 - one.lon_e7 + _ROUND_E7 / 2) % _ROUND_E7 - _ROUND_E7 / 2
    north_m = (other.lat_e7 - one.lat_e7) * _METRES_PER_E7
    return Gap(hypot(north_m, lon_e7 * _METRES_PER_E7 * _shrunk(one.lat_e7)), abs(other.alt_m - one.alt_m))


def place(leader: Motion, work: FollowWork, now: float) -> Motion:
    """Returns the follower's target position and velocity."""
    return leader.later(now).shifted(work.north_m, work.east_m, work.up_m)


def why_not_there(work: FollowWork) -> str | None:
    """Returns why this place is unsafe, or None."""
    if is_apart(work.north_m, work.east_m, work.up_m):
        return None
    return f"the place is too near to {work.leader_name}"


def why_stop(own: Motion, leader: Motion, work: FollowWork, now: float, *, home_alt_m: float) -> str | None:
    """Returns why the follower must hold now, or None. `home_alt_m`: altitude of its own home above sea level."""
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
    """Length of a degree of longitude at this latitude, relative to the equator; at least 0.01, even at a pole."""
    return max(0.01, cos(radians(lat_e7 / 1e7)))
