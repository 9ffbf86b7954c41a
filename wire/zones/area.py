"""The ground of a zone: a ring of points, or a line with a width. Pure geometry, in metres around its own middle.

Edges are straight between their points on a flat map. A zone is at most MAX_EXTENT_M across, so that this is true to
a metre near its edge.
"""

from collections.abc import Sequence
from itertools import chain
from math import cos, hypot, inf, radians
from typing import Final, NamedTuple

METRES_PER_DEGREE: Final = 111_319.5

Points = Sequence[tuple[float, float]]
"""Latitude and longitude in degrees."""
Span = tuple[float, float]
"""From and to, as shares of a track: 0 to 1."""
_Edge = tuple[float, float, float, float, float]
"""x and y of its beginning, the way to its end, and the square of its length."""
_MIN_EDGE_M: Final = 1e-6


class Box(NamedTuple):
    """Degrees."""

    south: float
    west: float
    north: float
    east: float

    def meets(self, other: "Box") -> bool:
        """Whether the two have a point in common."""
        return (
            self.south <= other.north
            and other.south <= self.north
            and self.west <= other.east
            and other.west <= self.east
        )

    def widened(self, by_m: float) -> "Box":
        lat = by_m / METRES_PER_DEGREE
        lon = lat / max(0.01, cos(radians(max(abs(self.south), abs(self.north)))))
        return Box(self.south - lat, self.west - lon, self.north + lat, self.east + lon)


class Area:
    """`width_m`: of a line; None: `points` are the corners of an area, in order, the first one not repeated."""

    def __init__(self, points: Points, width_m: float | None = None) -> None:
        lats, lons = [lat for lat, _ in points], [lon for _, lon in points]
        south, west, north, east = min(lats), min(lons), max(lats), max(lons)
        self._lat, self._lon = (south + north) / 2, (west + east) / 2
        self._east_m = METRES_PER_DEGREE * cos(radians(self._lat))
        self._half_m = None if width_m is None else width_m / 2
        corners = [self.metres(lat, lon) for lat, lon in points]
        ends = corners[1:] if width_m is not None else [*corners[1:], corners[0]]
        self._edges: list[_Edge] = []
        for (x, y), (to_x, to_y) in zip(corners, ends, strict=False):
            along, up = to_x - x, to_y - y
            if abs(along) > _MIN_EDGE_M or abs(up) > _MIN_EDGE_M:
                self._edges.append((x, y, along, up, along * along + up * up))
        self.box = Box(south, west, north, east).widened(self._half_m or 0.0)
        self._low_m = min(y for _, y in corners)
        height_m = max(y for _, y in corners) - self._low_m
        # Edges by their height on the map: a point or a short way looks at a few of a hundred.
        count = max(1, len(self._edges) // 3) if height_m > 0 else 1
        self._band_m = height_m / count or 1.0
        self._bands: list[list[_Edge]] = [[] for _ in range(count)]
        for edge in self._edges:
            first, last = self._band_of(min(edge[1], edge[1] + edge[3])), self._band_of(max(edge[1], edge[1] + edge[3]))
            for band in range(first, last + 1):
                self._bands[band].append(edge)

    def metres(self, lat_deg: float, lon_deg: float) -> tuple[float, float]:
        """East and north of the middle of the area."""
        return (lon_deg - self._lon) * self._east_m, (lat_deg - self._lat) * METRES_PER_DEGREE

    def contains(self, lat_deg: float, lon_deg: float) -> bool:
        x, y = self.metres(lat_deg, lon_deg)
        if self._half_m is not None:
            return self._from_line_m(x, y, self._half_m) <= self._half_m
        inside = False
        for ax, ay, along, up, _ in self._bands[self._band_of(y)]:
            if (ay > y) != (ay + up > y) and x < ax + along * (y - ay) / up:
                inside = not inside
        return inside

    def edge_m(self, lat_deg: float, lon_deg: float, most_m: float = inf) -> float:
        """How far the edge is, from inside or from outside; some value above `most_m` if it is further than that."""
        from_line_m = self._from_line_m(*self.metres(lat_deg, lon_deg), most_m + (self._half_m or 0.0))
        return from_line_m if self._half_m is None else abs(from_line_m - self._half_m)

    def may_meet(self, box: Box) -> bool:
        """False: no way inside the box touches the area. True: it may."""
        middle = (box.south + box.north) / 2, (box.west + box.east) / 2
        reach_m = hypot((box.north - box.south) / 2 * METRES_PER_DEGREE, (box.east - box.west) / 2 * self._east_m)
        return self.contains(*middle) or self.edge_m(*middle, reach_m) <= reach_m

    def spans(self, start: tuple[float, float], end: tuple[float, float]) -> list[Span]:
        """Which parts of the straight way from `start` to `end` (latitude, longitude) are inside; none overlap."""
        x, y = self.metres(*start)
        to_x, to_y = self.metres(*end)
        if self._half_m is not None:
            return _united([one for edge in self._edges for one in _along(edge, x, y, to_x, to_y, self._half_m)])
        return self._ring_spans(x, y, to_x - x, to_y - y, starts_inside=self.contains(*start))

    def _ring_spans(self, x: float, y: float, along: float, up: float, *, starts_inside: bool) -> list[Span]:
        crossings = set()
        low, high = self._band_of(min(y, y + up)), self._band_of(max(y, y + up))
        edges = self._edges if high - low > len(self._bands) // 2 else chain(*self._bands[low : high + 1])
        for ax, ay, edge_along, edge_up, _ in edges:
            cross = along * edge_up - up * edge_along
            if cross == 0:
                continue
            east, north = ax - x, ay - y
            share = (east * edge_up - north * edge_along) / cross
            at_edge = (east * up - north * along) / cross
            if 0 < share <= 1 and 0 <= at_edge < 1:
                crossings.add(share)  # an edge may be in several bands
        shares = sorted(crossings)
        marks = [0.0, *shares, 1.0] if starts_inside else [*shares, 1.0]
        return [(a, b) for a, b in zip(marks[::2], marks[1::2], strict=False) if b > a or starts_inside]

    def _band_of(self, y: float) -> int:
        band = int((y - self._low_m) / self._band_m)
        return 0 if band < 0 else min(band, len(self._bands) - 1)

    def _from_line_m(self, x: float, y: float, most_m: float) -> float:
        """Outwards from the band of `y`, until no other band can have a nearer edge."""
        nearest = most_m * most_m
        own = self._band_of(y)
        for step in range(len(self._bands)):
            beyond = (step - 1) * self._band_m
            if beyond > 0 and beyond * beyond > nearest:
                break
            for band in (own + step, own - step) if step else (own,):
                if not 0 <= band < len(self._bands):
                    continue
                for ax, ay, along, up, square in self._bands[band]:
                    east, north = x - ax, y - ay
                    share = (east * along + north * up) / square
                    share = 0.0 if share < 0 else 1.0 if share > 1 else share
                    east -= along * share
                    north -= up * share
                    square_m = east * east + north * north
                    if square_m < nearest:
                        nearest = square_m
        return float(nearest**0.5) + (1e-6 if nearest == most_m * most_m else 0.0)


def _along(edge: _Edge, x: float, y: float, to_x: float, to_y: float, radius_m: float) -> list[Span]:
    """Where a way is within `radius_m` of an edge: of its ends, or beside it."""
    ax, ay, along, up, square = edge
    found = [_in_circle(x - end_x, y - end_y, to_x - x, to_y - y, radius_m) for end_x, end_y in
             ((ax, ay), (ax + along, ay + up))]  # fmt: skip
    length = square**0.5
    # Turned so that the edge is the x axis.
    east, north = x - ax, y - ay
    way_east, way_north = to_x - x, to_y - y
    lengthwise = _between((east * along + north * up) / length, (way_east * along + way_north * up) / length, 0, length)
    sideways = _between(
        (north * along - east * up) / length, (way_north * along - way_east * up) / length, -radius_m, radius_m
    )
    if lengthwise is not None and sideways is not None:
        both = max(lengthwise[0], sideways[0]), min(lengthwise[1], sideways[1])
        if both[0] <= both[1]:
            found.append(both)
    return [one for one in found if one is not None]


def _between(start: float, way: float, low: float, high: float) -> Span | None:
    if way == 0:
        return (0.0, 1.0) if low <= start <= high else None
    first, last = sorted(((low - start) / way, (high - start) / way))
    first, last = max(first, 0.0), min(last, 1.0)
    return (first, last) if first <= last else None


def _in_circle(x: float, y: float, along: float, up: float, radius_m: float) -> Span | None:
    a = along * along + up * up
    if a == 0:
        return (0.0, 1.0) if hypot(x, y) <= radius_m else None
    b = x * along + y * up
    inner = b * b - a * (x * x + y * y - radius_m * radius_m)
    if inner < 0:
        return None
    root = inner**0.5
    first, last = max((-b - root) / a, 0.0), min((-b + root) / a, 1.0)
    return (first, last) if first <= last else None


def _united(spans: list[Span]) -> list[Span]:
    """Those that touch become one."""
    united: list[Span] = []
    for first, last in sorted(spans):
        if united and first <= united[-1][1] + 1e-9:
            united[-1] = (united[-1][0], max(united[-1][1], last))
        else:
            united.append((first, last))
    return united


def both(spans: list[Span], other: Span) -> list[Span]:
    """The parts of `spans` that are in `other` too."""
    cut = [(max(first, other[0]), min(last, other[1])) for first, last in spans]
    return [(first, last) for first, last in cut if first <= last]


def outside(spans: list[Span]) -> list[Span]:
    """The parts of the whole way that are in none of `spans`."""
    found, at = [], 0.0
    for first, last in _united(spans):
        if first > at:
            found.append((at, first))
        at = max(at, last)
    if at < 1.0:
        found.append((at, 1.0))
    return found
