"""Which zones a plan, a go-to or another order would lead into. Pure.

A zone never bars a hold, a return or a landing where the drone is: those name no place to go to. What has no place
that can be judged here (sticks, velocities, modes) is for the watch in flight.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Final, NamedTuple

from server.control.core.loan_limits import Home
from server.control.core.loan_requests import Target
from server.control.core.loan_tables import CIRCLE_IN, ITEMS_AT_A_PLACE, UP_OR_DOWN
from wire.dialect import mavlink
from wire.plans import PlanItem, PlanKind
from wire.zones.area import Box, Span
from wire.zones.index import ZoneIndex
from wire.zones.kinds import HeightAbove
from wire.zones.track import Spot, Track, is_within
from wire.zones.ways import NEAR_M, crossings_of, words_of
from wire.zones.zone import Zone

_M: Final = mavlink
_RELATIVE: Final = frozenset({3, 6})
_ABOVE_SEA: Final = frozenset({0, 5})
_GLOBAL: Final = _RELATIVE | _ABOVE_SEA | {10, 11}
_JUMP: Final = _M.MAV_CMD_DO_JUMP
_TAKE_OFFS: Final = frozenset({_M.MAV_CMD_NAV_TAKEOFF, _M.MAV_CMD_NAV_VTOL_TAKEOFF})
LANDINGS: Final = frozenset({_M.MAV_CMD_NAV_LAND, _M.MAV_CMD_NAV_VTOL_LAND})
MAX_FOUND: Final = 20
"""Items named for one plan. The rest of a bad plan is no news."""


@dataclass(frozen=True)
class ZoneHit:
    """`item`: of a plan, from 0."""

    zone: Zone
    item: int | None = None

    @property
    def words(self) -> str:
        """What it would do: ends a sentence about the drone, or about the way to an item."""
        return words_of(self.zone)


def spots_of(target: Target, home: Home | None, here: Spot) -> list[Spot]:
    """The places that the target may mean: one for each way to read its height."""
    lat_deg = here.lat_deg if target.lat_deg is None else target.lat_deg
    lon_deg = here.lon_deg if target.lon_deg is None else target.lon_deg
    if target.alt_m is None:
        return [Spot(lat_deg, lon_deg, here.above_home_m, here.above_sea_m)]
    return [_spot(lat_deg, lon_deg, target.alt_m, frame, home) for frame in dict.fromkeys(target.frames)]


def hits_on_the_way(index: ZoneIndex, here: Spot, to: Spot, circle_m: float = 0.0) -> list[Zone]:
    """Zones that the straight way enters, or the circle at its end touches, the first one first. A way out of a zone is
    free, and so is one towards its edge."""
    hit = {one.zone.id: one.zone for one in crossings_of(index, here, to)}
    if circle_m > 0:
        near = index.near(Track(here, to).box.widened(max(circle_m, NEAR_M)))
        hit |= {zone.id: zone for zone in _touched(near, to, circle_m)}
    return list(hit.values())


def plan_hits(
    index: ZoneIndex, kind: PlanKind, items: Sequence[PlanItem], home: Home | None, here: Spot | None
) -> list[ZoneHit]:
    """At most one zone for each item: one that refuses before one that warns. `here`: where the drone is, if it is in
    the air. Fences are no way of a drone."""
    if not index or kind is PlanKind.FENCE:
        return []
    if kind is PlanKind.RALLY:
        spots = [_spot(item.x / 1e7, item.y / 1e7, item.z, item.frame, home) for item in items]
        return _first([ZoneHit(zone, at) for at, spot in enumerate(spots) for zone in _touched(
            index.near(Track(spot, spot).box.widened(NEAR_M)), spot, 0.0)])  # fmt: skip
    ways = list(_ways(items, home, here))
    among = _among(index, ways)
    hits: list[ZoneHit] = []
    for way in ways:
        hits += [ZoneHit(zone, way.item) for zone in hits_on_the_way(among, way.start, way.end, way.circle_m)]
        if len({hit.item for hit in hits}) >= MAX_FOUND:
            break
    return _first(hits)


class _Way(NamedTuple):
    """To the place of an item."""

    item: int
    start: Spot
    end: Spot
    circle_m: float = 0.0


def _ways(items: Sequence[PlanItem], home: Home | None, here: Spot | None) -> Iterator[_Way]:
    places: dict[int, Spot] = {}
    at = here if here is not None else _on_ground(home)
    for number, item in enumerate(items):
        if item.command == _JUMP:
            to = places.get(int(item.params[0] or 0))
            if at is not None and to is not None:
                yield _Way(number, at, to)
            continue
        spot = _item_spot(item, at, home)
        if spot is None:
            continue
        yield _Way(number, at or spot, spot, _circle_m(item))
        places[number] = at = spot


def _among(index: ZoneIndex, ways: Sequence[_Way]) -> ZoneIndex:
    """The zones that these ways may enter, and all corridors."""
    if not ways:
        return index
    spots = [spot for way in ways for spot in (way.start, way.end)]
    lats, lons = [spot.lat_deg for spot in spots], [spot.lon_deg for spot in spots]
    box = Box(min(lats), min(lons), max(lats), max(lons)).widened(max(NEAR_M, *(way.circle_m for way in ways)))
    heights_m: dict[HeightAbove, Span] = {}
    for above in HeightAbove:
        known = [height_m for spot in spots if (height_m := spot.height_m(above)) is not None]
        heights_m[above] = (min(known), max(known)) if len(known) == len(spots) else (-inf, inf)
    return index.within(box, heights_m)


def _first(hits: Iterable[ZoneHit]) -> list[ZoneHit]:
    found: dict[int | None, ZoneHit] = {}
    for hit in hits:
        known = found.get(hit.item)
        if known is None or (hit.zone.binds and not known.zone.binds):
            found[hit.item] = hit
    return list(found.values())[:MAX_FOUND]


def _item_spot(item: PlanItem, at: Spot | None, home: Home | None) -> Spot | None:
    if item.command not in ITEMS_AT_A_PLACE or item.frame not in _GLOBAL:
        return None
    stays = item.x == 0 and item.y == 0 and (item.command in UP_OR_DOWN or at is not None)
    if stays and at is None:
        return None
    lat_deg, lon_deg = (at.lat_deg, at.lon_deg) if stays and at is not None else (item.x / 1e7, item.y / 1e7)
    if item.command in LANDINGS:
        ground = _spot(lat_deg, lon_deg, 0.0, 3, home)
        return ground if at is None else Spot(lat_deg, lon_deg, ground.above_home_m, ground.above_sea_m)
    return _spot(lat_deg, lon_deg, item.z, item.frame, home)


def _circle_m(item: PlanItem) -> float:
    number = CIRCLE_IN.get(item.command)
    radius = item.params[number] if number is not None else None
    return abs(radius) if radius is not None and isfinite(radius) else 0.0


def _on_ground(home: Home | None) -> Spot | None:
    return None if home is None else Spot(home.lat_deg, home.lon_deg, 0.0, home.alt_amsl_m)


def _spot(lat_deg: float, lon_deg: float, alt_m: float, frame: int, home: Home | None) -> Spot:
    if frame in _RELATIVE:
        return Spot(lat_deg, lon_deg, alt_m, None if home is None else home.alt_amsl_m + alt_m)
    if frame in _ABOVE_SEA:
        return Spot(lat_deg, lon_deg, None if home is None else alt_m - home.alt_amsl_m, alt_m)
    return Spot(lat_deg, lon_deg, None, None)


def _touched(zones: Sequence[Zone], spot: Spot, circle_m: float) -> list[Zone]:
    """Zones that a circle around the spot is in, partly or wholly."""
    found = []
    for zone in zones:
        within = is_within(zone, spot)
        edge_m = zone.area.edge_m(spot.lat_deg, spot.lon_deg)
        if zone.is_corridor:
            continue
        height_m, (low, high) = spot.height_m(zone.height_above), zone.heights_m
        if within or (edge_m <= circle_m and circle_m > 0 and (height_m is None or low < height_m < high)):
            found.append(zone)
    groups = {zone.team_id for zone in zones if zone.is_corridor}
    for team_id in groups:
        group = [zone for zone in zones if zone.is_corridor and zone.team_id == team_id]
        if not any(is_within(one, spot) and one.area.edge_m(spot.lat_deg, spot.lon_deg) >= circle_m for one in group):
            found.append(group[0])
    return found
