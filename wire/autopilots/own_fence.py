"""The fence that an autopilot keeps by itself: what its parameters say, and whether a place is outside it. Pure.

The floor of a fence (FENCE_ALT_MIN) is not judged: autopilots switch it off near the ground.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from wire.dialect import mavlink
from wire.plans import PlanItem
from wire.zones.area import Area
from wire.zones.track import Spot, Track

_M: Final = mavlink
_POLYGONS: Final = {
    _M.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: False,
    _M.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: True,
}
_CIRCLES: Final = {_M.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: False, _M.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: True}
"""Whether to keep out of it."""
_MIN_CORNERS: Final = 3


@dataclass(frozen=True)
class OwnFence:
    """Metres above home and around home; None: no such limit. The names are those of its parameters."""

    max_height_m: float | None
    height_name: str
    radius_m: float | None
    radius_name: str
    has_areas: bool
    """The areas and circles on board count."""
    one_is_enough: bool = False
    """A place must be in one of the areas; else in all of them."""


def why_outside(
    fence: OwnFence, spot: Spot, home: Spot | None, areas: Sequence[PlanItem], *, circle_m: float = 0.0
) -> str | None:
    """Returns the end of a sentence about a place outside the fence, or None. What is not known is not judged.

    `areas`: the items of the fence on board. `circle_m`: the radius of an orbit around the place.
    """
    if fence.max_height_m is not None and spot.above_home_m is not None and spot.above_home_m > fence.max_height_m:
        return f"{spot.above_home_m:.0f} m above home, and {fence.height_name} is {fence.max_height_m:g} m"
    if fence.radius_m is not None and home is not None:
        reach_m = Track(home, spot).length_m + circle_m
        if reach_m > fence.radius_m:
            return f"{reach_m:.0f} m from home, and {fence.radius_name} is {fence.radius_m:g} m"
    return _why_outside_areas(fence, spot, areas, circle_m) if fence.has_areas else None


def _why_outside_areas(fence: OwnFence, spot: Spot, items: Sequence[PlanItem], circle_m: float) -> str | None:
    depths = _depths_m(items, spot)
    if any(depth_m > -circle_m for is_kept_out, depth_m in depths if is_kept_out):
        return "in an area that it excludes"
    inside = [depth_m >= circle_m for is_kept_out, depth_m in depths if not is_kept_out]
    is_in = not inside or (any(inside) if fence.one_is_enough else all(inside))
    return None if is_in else "outside the area that it keeps"


def _depths_m(items: Sequence[PlanItem], spot: Spot) -> list[tuple[bool, float]]:
    """Of each area: whether it is to be kept out of, and how deep inside the spot is; negative outside."""
    found: list[tuple[bool, float]] = []
    at = 0
    while at < len(items):
        item = items[at]
        count = 1
        if item.command in _CIRCLES:
            centre = Spot(item.x / 1e7, item.y / 1e7, None, None)
            found.append((_CIRCLES[item.command], (item.params[0] or 0.0) - Track(centre, spot).length_m))
        elif item.command in _POLYGONS:
            count = max(int(item.params[0] or 0), 1)
            corners = [(one.x / 1e7, one.y / 1e7) for one in items[at : at + count]]
            if len(corners) >= _MIN_CORNERS:
                area = Area(corners)
                edge_m = area.edge_m(spot.lat_deg, spot.lon_deg)
                is_inside = area.contains(spot.lat_deg, spot.lon_deg)
                found.append((_POLYGONS[item.command], edge_m if is_inside else -edge_m))
        at += count
    return found
