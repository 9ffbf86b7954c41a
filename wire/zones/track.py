"""A straight way through the air, and which zones it enters. Pure: the same for a drone in flight, a go-to, a plan."""

from collections.abc import Iterable, Sequence
from math import cos, hypot, inf, radians
from typing import Final, NamedTuple

from wire.zones.area import METRES_PER_DEGREE, Box, Span, both, outside
from wire.zones.kinds import HeightAbove
from wire.zones.zone import Zone

_WHOLE: Final[Span] = (0.0, 1.0)
"""Of a way."""


class Spot(NamedTuple):
    """Heights None: not known, so any height is possible."""

    lat_deg: float
    lon_deg: float
    above_home_m: float | None
    above_sea_m: float | None

    def height_m(self, above: HeightAbove) -> float | None:
        return self.above_home_m if above is HeightAbove.HOME else self.above_sea_m


class Track(NamedTuple):
    start: Spot
    end: Spot

    @property
    def box(self) -> Box:
        (lat, lon, *_), (to_lat, to_lon, *_) = self
        return Box(min(lat, to_lat), min(lon, to_lon), max(lat, to_lat), max(lon, to_lon))

    @property
    def length_m(self) -> float:
        """Over ground."""
        north = (self.end.lat_deg - self.start.lat_deg) * METRES_PER_DEGREE
        east = (self.end.lon_deg - self.start.lon_deg) * METRES_PER_DEGREE * cos(radians(self.start.lat_deg))
        return hypot(north, east)


class Crossing(NamedTuple):
    """`zone`: for corridors, the nearest one that should not be left. `span`: where the way is forbidden."""

    zone: Zone
    span: Span

    @property
    def starts_there(self) -> bool:
        return self.span[0] <= 0.0

    @property
    def ends_there(self) -> bool:
        return self.span[1] >= 1.0


def crossings(zones: Iterable[Zone], track: Track) -> list[Crossing]:
    """The forbidden parts of the way, the first one first. `zones`: those that count for this drone."""
    found, corridors = [], dict[int | None, list[Zone]]()
    box = track.box
    for zone in zones:
        if zone.is_corridor:
            corridors.setdefault(zone.team_id, []).append(zone)
        elif zone.area.box.meets(box):
            found += [Crossing(zone, span) for span in _within(zone, track)]
    for group in corridors.values():
        allowed = [span for zone in group if zone.area.box.meets(box) for span in _within(zone, track)]
        left = outside(allowed)
        if left:
            zone = nearest(group, track.start)
            found += [Crossing(zone, span) for span in left]
    return sorted(found, key=lambda one: one.span)


def depths(zone: Zone, spot: Spot, group: Sequence[Zone] = ()) -> tuple[float, float]:
    """How deep a spot is in what the zone forbids: over ground, and in height; 0 where it is not. `inf` in height: no
    way out. `group`: the other corridors that count beside this one."""
    if zone.is_corridor:
        return _beyond(nearest([zone, *group], spot), spot)
    edge_m = zone.area.edge_m(spot.lat_deg, spot.lon_deg)
    inside = zone.area.contains(spot.lat_deg, spot.lon_deg)
    height_m = spot.height_m(zone.height_above)
    low, high = zone.heights_m
    return (edge_m if inside else 0.0), inf if height_m is None else max(0.0, min(height_m - low, high - height_m))


def is_within(zone: Zone, spot: Spot) -> bool:
    """Whether the spot is in the space of the zone. An unknown height is."""
    if not zone.area.contains(spot.lat_deg, spot.lon_deg):
        return False
    height_m = spot.height_m(zone.height_above)
    low, high = zone.heights_m
    return height_m is None or low <= height_m <= high


def nearest(corridors: Sequence[Zone], spot: Spot) -> Zone:
    return min(corridors, key=lambda zone: sum(_beyond(zone, spot)))


def _beyond(corridor: Zone, spot: Spot) -> tuple[float, float]:
    """How far a spot is outside of a corridor: over ground, and in height."""
    inside = corridor.area.contains(spot.lat_deg, spot.lon_deg)
    height_m = spot.height_m(corridor.height_above)
    low, high = corridor.heights_m
    beyond_m = 0.0 if height_m is None else max(0.0, low - height_m, height_m - high)
    return (0.0 if inside else corridor.area.edge_m(spot.lat_deg, spot.lon_deg)), beyond_m


def _within(zone: Zone, track: Track) -> list[Span]:
    """Where the way is in the space of the zone. An unknown height is in a zone, and in a corridor."""
    start, end = track
    in_height = _in_height(zone, start.height_m(zone.height_above), end.height_m(zone.height_above))
    if in_height is None:
        return []
    spans = zone.area.spans((start.lat_deg, start.lon_deg), (end.lat_deg, end.lon_deg))
    if in_height == _WHOLE:
        return spans
    return [one for one in both(spans, in_height) if one[1] > one[0] or zone.is_corridor]


def _in_height(zone: Zone, from_m: float | None, to_m: float | None) -> Span | None:
    """Which part of the way is between the heights of the zone; None: no part."""
    low, high = zone.heights_m
    if from_m is None or to_m is None or (low == -inf and high == inf):
        return _WHOLE
    climb = to_m - from_m
    if climb == 0:
        return _WHOLE if low < from_m < high or (zone.is_corridor and low <= from_m <= high) else None
    first, last = sorted(((low - from_m) / climb, (high - from_m) / climb))
    return None if last < 0 or first > 1 else (max(first, 0.0), min(last, 1.0))
