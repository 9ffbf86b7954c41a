"""Whether a mission flies into the ground: its legs, measured against the height of the ground under them.

Only what is certain is judged. Without a home, or where the height of the ground is not known, nothing is said.
Heights over home are measured from the ground at home, so that a height of home that its receiver has wrong by some
metres does not count.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import ceil, cos, hypot, radians
from typing import Final

from server.kernel.refusal import Refusal
from wire.dialect import mavlink
from wire.plans import PlanItem

Heights = Callable[[Sequence[tuple[float, float]]], list[float | None]]
"""Metres above the sea at places of latitude and longitude in degrees; None where it is not known."""

STEP_M: Final = 10.0
MAX_POINTS: Final = 20_000
"""Of a whole mission: a longer one is looked at in wider steps."""
ON_THE_SPOT_M: Final = 1.0
"""Shorter legs climb or descend where they are."""
_METRES_PER_DEGREE: Final = 111_319.49

_TAKE_OFF: Final = {mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_VTOL_TAKEOFF}
_LAND: Final = {mavlink.MAV_CMD_NAV_LAND, mavlink.MAV_CMD_NAV_VTOL_LAND}
_RETURN: Final = mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH
_FLIES: Final = {
    mavlink.MAV_CMD_NAV_WAYPOINT,
    mavlink.MAV_CMD_NAV_SPLINE_WAYPOINT,
    mavlink.MAV_CMD_NAV_LOITER_UNLIM,
    mavlink.MAV_CMD_NAV_LOITER_TURNS,
    mavlink.MAV_CMD_NAV_LOITER_TIME,
    mavlink.MAV_CMD_NAV_LOITER_TO_ALT,
}
_ABOVE_SEA: Final = {mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT}
_ABOVE_GROUND: Final = {mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT, mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT}
_ABOVE_HOME: Final = {mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT}


class IntoTheGround(Refusal):
    """`item`: the item that the leg leads to, from 0."""

    def __init__(self, drone: str, item: int, clearance_m: float, lowest_m: float) -> None:
        where = f"{-lowest_m:.0f} m below the ground" if lowest_m < 0 else f"only {lowest_m:.0f} m above the ground"
        super().__init__(
            f"the way of {drone} to item {item + 1} is {where}; {clearance_m:.0f} m is the least on this tower"
        )
        self.item = item


@dataclass(frozen=True, slots=True)
class Origin:
    """Home: degrees, and metres above the sea as the drone says."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float


@dataclass(frozen=True, slots=True)
class _Point:
    lat_deg: float
    lon_deg: float
    height_m: float
    """Above the sea; above the ground if `over_ground`."""
    over_ground: bool


@dataclass(frozen=True, slots=True)
class _Leg:
    item: int
    begin: _Point
    end: _Point
    length_m: float


@dataclass(frozen=True, slots=True)
class Lowest:
    item: int
    above_ground_m: float


def lowest_leg(items: Sequence[PlanItem], home: Origin | None, heights: Heights, clearance_m: float) -> Lowest | None:
    """Returns the first leg that comes nearer to the ground than the clearance, with its least height."""
    if home is None:
        return None
    ground_m = heights([(home.lat_deg, home.lon_deg)])[0]
    if ground_m is None:
        return None
    legs = list(_legs(items, home, ground_m))
    step_m = max(STEP_M, sum(leg.length_m for leg in legs) / MAX_POINTS)
    for leg in legs:
        parts = max(ceil(leg.length_m / step_m), 1)
        shares = [part / parts for part in range(parts + 1)]
        found = heights([_place_at(leg, share) for share in shares])
        ends = _above_sea(leg.begin, found[0]), _above_sea(leg.end, found[-1])
        if ends[0] is None or ends[1] is None:
            continue
        gaps = [
            ends[0] + (ends[1] - ends[0]) * share - ground
            for share, ground in zip(shares, found, strict=True)
            if ground is not None
        ]
        # A drone in the terrain frame follows the ground between the ends.
        if leg.begin.over_ground and leg.end.over_ground:
            gaps = [leg.begin.height_m, leg.end.height_m]
        if gaps and min(gaps) < clearance_m:
            return Lowest(leg.item, min(gaps))
    return None


def refuse_into_the_ground(
    drone: str, items: Sequence[PlanItem], home: Origin | None, heights: Heights, clearance_m: float
) -> None:
    """Raises IntoTheGround."""
    lowest = lowest_leg(items, home, heights, clearance_m)
    if lowest is not None:
        raise IntoTheGround(drone, lowest.item, clearance_m, lowest.above_ground_m)


def _legs(items: Sequence[PlanItem], home: Origin, ground_m: float) -> Iterator[_Leg]:
    """Yields the legs in the order of the list; what climbs or lands on the spot is left out."""
    here = _Point(home.lat_deg, home.lon_deg, ground_m, over_ground=False)
    for number, item in enumerate(items):
        if item.command in _TAKE_OFF:
            height = _height(item, home, ground_m)
            if height is not None:
                here = _Point(here.lat_deg, here.lon_deg, *height)
            continue
        if item.command == _RETURN:
            return  # at the drone's own return height: see the console's check
        lands = item.command in _LAND
        if not lands and item.command not in _FLIES:
            continue
        to = _target(item, here, home, ground_m)
        if to is None:
            return
        if lands:  # it flies there as high as it is, and then comes down
            to = _Point(to.lat_deg, to.lon_deg, here.height_m, here.over_ground)
        length_m = _distance_m(here, to)
        if length_m > ON_THE_SPOT_M:
            yield _Leg(number, here, to, length_m)
        here = to


def _target(item: PlanItem, here: _Point, home: Origin, ground_m: float) -> _Point | None:
    height = _height(item, home, ground_m)
    if height is None:
        return None
    if item.x == 0 and item.y == 0:
        return _Point(here.lat_deg, here.lon_deg, *height)
    return _Point(item.x / 1e7, item.y / 1e7, *height)


def _height(item: PlanItem, home: Origin, ground_m: float) -> tuple[float, bool] | None:
    if item.frame in _ABOVE_GROUND:
        return item.z, True
    if item.frame in _ABOVE_HOME:
        return ground_m + item.z, False
    if item.frame in _ABOVE_SEA:
        return item.z - home.alt_amsl_m + ground_m, False
    return None


def _above_sea(point: _Point, ground_m: float | None) -> float | None:
    if not point.over_ground:
        return point.height_m
    return None if ground_m is None else ground_m + point.height_m


def _place_at(leg: _Leg, share: float) -> tuple[float, float]:
    east = (leg.end.lon_deg - leg.begin.lon_deg + 180.0) % 360.0 - 180.0
    lon = (leg.begin.lon_deg + east * share + 180.0) % 360.0 - 180.0
    return leg.begin.lat_deg + (leg.end.lat_deg - leg.begin.lat_deg) * share, lon


def _distance_m(one: _Point, other: _Point) -> float:
    north = (other.lat_deg - one.lat_deg) * _METRES_PER_DEGREE
    east = ((other.lon_deg - one.lon_deg + 180.0) % 360.0 - 180.0) * _METRES_PER_DEGREE * cos(radians(one.lat_deg))
    return hypot(north, east)
