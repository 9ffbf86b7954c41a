"""The closest that two drones come to each other if both fly on as they do. Pure geometry.

Two drones conflict while they are near each other over ground *and* in height at the same moment: passing 5 m beside
each other 50 m higher is none, and neither is being 3 m higher a kilometre away.
"""

from math import hypot, inf, sqrt
from typing import Final, NamedTuple

from server.airspace.core.separation.motion import Relative

_STILL_M2_S2: Final = 1e-6
"""The square of a speed below which two drones keep their distance over ground."""
_LEVEL_M_S: Final = 1e-4


class Approach(NamedTuple):
    """A conflict to come. Seconds from now; metres at the moment when they are closest over ground within it."""

    begins_s: float
    in_s: float
    horizontal_m: float
    vertical_m: float


def conflict_ahead(seen: Relative, *, horizontal_m: float, vertical_m: float, ahead_s: float) -> Approach | None:
    """Within the next `ahead_s` seconds, where both distances fall below the given ones at once; None: never."""
    first, last = _near_over_ground(seen, horizontal_m)
    low, high = _near_in_height(seen, vertical_m)
    first, last = max(first, low, 0.0), min(last, high, ahead_s)
    if first >= last:
        return None
    speed2 = seen.east_m_s**2 + seen.north_m_s**2
    closing = seen.east_m * seen.east_m_s + seen.north_m * seen.north_m_s
    in_s = min(max(-closing / speed2, first), last) if speed2 > _STILL_M2_S2 else first
    east, north = seen.east_m + seen.east_m_s * in_s, seen.north_m + seen.north_m_s * in_s
    return Approach(first, in_s, hypot(east, north), abs(seen.up_m + seen.up_m_s * in_s))


def _near_over_ground(seen: Relative, within_m: float) -> tuple[float, float]:
    speed2 = seen.east_m_s**2 + seen.north_m_s**2
    beyond2 = seen.east_m**2 + seen.north_m**2 - within_m**2
    if speed2 <= _STILL_M2_S2:
        return (-inf, inf) if beyond2 < 0 else (inf, -inf)
    closing = seen.east_m * seen.east_m_s + seen.north_m * seen.north_m_s
    root2 = closing**2 - speed2 * beyond2
    if root2 <= 0:
        return inf, -inf
    root = sqrt(root2)
    return (-closing - root) / speed2, (-closing + root) / speed2


def _near_in_height(seen: Relative, within_m: float) -> tuple[float, float]:
    if abs(seen.up_m_s) <= _LEVEL_M_S:
        return (-inf, inf) if abs(seen.up_m) < within_m else (inf, -inf)
    one, other = (-within_m - seen.up_m) / seen.up_m_s, (within_m - seen.up_m) / seen.up_m_s
    return min(one, other), max(one, other)
