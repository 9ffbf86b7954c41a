"""What makes a zone valid. Pure."""

from math import cos, isfinite, radians
from typing import Final

from server.kernel.names import clean_name
from server.kernel.refusal import Refusal
from wire.zones.area import METRES_PER_DEGREE
from wire.zones.kinds import ZoneKind
from wire.zones.zone import Zone

MAX_POINTS: Final = 500
"""Of one zone. Airspace as published has fewer."""
MAX_ZONES: Final = 500
"""Of the whole tower."""
MAX_REASON: Final = 200
MAX_EXTENT_M: Final = 200_000.0
MAX_LAT_DEG: Final = 85.0
MIN_WIDTH_M: Final = 2.0
MAX_WIDTH_M: Final = 50_000.0
MAX_HEIGHT_M: Final = 20_000.0
MIN_HEIGHT_M: Final = -1_000.0


class BadZone(Refusal):
    """Not a valid zone. `field`: which part is wrong."""

    def __init__(self, field: str, words: str) -> None:
        super().__init__(words)
        self.field = field


def checked(zone: Zone) -> Zone:
    """The zone as it is stored. Raises BadZone, BadName."""
    _check_shape(zone)
    _check_heights(zone)
    if zone.valid_from is not None and zone.valid_until is not None and zone.valid_until <= zone.valid_from:
        raise BadZone("valid_until", "a zone must end after it begins")
    if len(zone.reason) > MAX_REASON or not (zone.reason.isprintable() or not zone.reason):
        raise BadZone("reason", f"a reason has at most {MAX_REASON} printable characters")
    name = clean_name(zone.name)
    return zone if name == zone.name else Zone(**{one: getattr(zone, one) for one in _FIELDS} | {"name": name})


_FIELDS: Final = tuple(one for one in Zone.__dataclass_fields__ if one != "area")


def check_points(points: tuple[tuple[float, float], ...], width_m: float | None) -> None:
    """Raises BadZone. Call it before the zone is made of them."""
    fewest = 3 if width_m is None else 2
    if not fewest <= len(points) <= MAX_POINTS:
        raise BadZone("points", f"a zone has {fewest} to {MAX_POINTS} points")
    for lat, lon in points:
        if not (isfinite(lat) and isfinite(lon) and abs(lat) <= MAX_LAT_DEG and abs(lon) <= 180.0):
            raise BadZone("points", f"points are within {MAX_LAT_DEG:.0f}° of latitude and 180° of longitude")
    if len(set(points)) < fewest:
        raise BadZone("points", "too many points are at the same place")
    lats, lons = [lat for lat, _ in points], [lon for _, lon in points]
    north_m = (max(lats) - min(lats)) * METRES_PER_DEGREE
    east_m = (max(lons) - min(lons)) * METRES_PER_DEGREE * cos(radians(min(abs(min(lats)), abs(max(lats)))))
    if max(north_m, east_m) > MAX_EXTENT_M:
        most_km = MAX_EXTENT_M / 1000
        raise BadZone(
            "points", f"a zone is at most {most_km:.0f} km across; draw several, also across 180° of longitude"
        )


def _check_shape(zone: Zone) -> None:
    width_m = zone.shape.width_m
    check_points(zone.shape.points, width_m)
    if width_m is not None and not MIN_WIDTH_M <= width_m <= MAX_WIDTH_M:
        raise BadZone("width_m", f"the width of a line is {MIN_WIDTH_M:.0f} to {MAX_WIDTH_M:.0f} m")
    if width_m is None and _crosses_itself(zone):
        raise BadZone("points", "the edge of the zone crosses itself: put its corners in order")


def _crosses_itself(zone: Zone) -> bool:
    """Two edges that have no corner in common cross. At most MAX_POINTS squared, once per change."""
    corners = [zone.area.metres(lat, lon) for lat, lon in zone.shape.points]
    edges = list(zip(corners, corners[1:] + corners[:1], strict=True))
    for at, (a, b) in enumerate(edges):
        for other in range(at + 2, len(edges)):
            if at == 0 and other == len(edges) - 1:
                continue
            c, d = edges[other]
            if _side(a, b, c) * _side(a, b, d) < 0 and _side(c, d, a) * _side(c, d, b) < 0:
                return True
    return False


def _side(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _check_heights(zone: Zone) -> None:
    for field_name, height_m in (("floor_m", zone.floor_m), ("ceiling_m", zone.ceiling_m)):
        if height_m is not None and not MIN_HEIGHT_M <= height_m <= MAX_HEIGHT_M:
            raise BadZone(field_name, f"heights are {MIN_HEIGHT_M:.0f} to {MAX_HEIGHT_M:.0f} m")
    if zone.kind is ZoneKind.HEIGHT_LIMIT:
        if zone.ceiling_m is None or zone.floor_m is not None:
            raise BadZone("ceiling_m", "a height limit has a highest height, and no lowest")
    elif zone.floor_m is not None and zone.ceiling_m is not None and zone.floor_m >= zone.ceiling_m:
        raise BadZone("ceiling_m", "the highest height must be above the lowest")
