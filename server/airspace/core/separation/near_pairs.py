"""Finds the pairs of many drones that can come close: a grid over the ground that each will cross. Pure.

A drone is entered into every cell that it crosses within the look-ahead time, with its times and heights there. Pairs
that never share a cell at one time and height are skipped. The work is done in small portions between frames, even for
a thousand drones.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from itertools import islice
from math import cos, floor, hypot, radians
from typing import Final

from server.airspace.core.separation.bounds import SeparationBounds, drift_m
from server.airspace.core.separation.motion import METRES_PER_DEGREE, Motion
from wire.ids import DroneId

Pair = tuple[DroneId, DroneId]
"""The lower number first."""

CELL_M: Final = 250.0
DRONES_A_PORTION: Final = 100
PAIRS_A_PORTION: Final = 100
"""Maximum number of pairs checked closely, and twenty times as many excluded at a glance."""
_MAX_LAT_DEG: Final = 89.0
"""Nearer to a pole the columns of the grid would run together."""

_ROUNDING_M: Final = 1.0
"""A degree of longitude is not as long where the one drone is as where the other is."""

_Stay = tuple[float, float, float, float, float, float, float, float, DroneId]
"""Lowest and highest height, from when to when, south and north, west and east edge (degrees), who."""


def near_pairs(
    motions: Mapping[DroneId, Motion],
    bounds: SeparationBounds,
    now: float,
    *,
    most_pairs: int,
    wanted: Callable[[Pair], bool] = lambda pair: True,
) -> Iterator[list[Pair]]:
    """Each wanted pair once, a portion at a time. Every one that comes within the bounds is among them, unless there
    were more than `most_pairs`: then it stops there."""
    cells: dict[tuple[int, int], list[_Stay]] = {}
    for count, (drone_id, motion) in enumerate(motions.items(), 1):
        _write(cells, drone_id, motion, bounds, now)
        if count % DRONES_A_PORTION == 0:
            yield []
    found: list[Pair] = []
    seen: set[Pair] = set()
    checked = 0
    for stays in cells.values():
        if len(stays) == 1:
            continue
        stays.sort()
        for at, (_, high, first, last, south, north, west, east, drone_id) in enumerate(stays, 1):
            for low, _, other_first, other_last, other_south, other_north, other_west, other_east, other_id in islice(
                stays, at, None
            ):
                if low > high:
                    break
                checked += 1
                if checked >= 20 * PAIRS_A_PORTION or len(found) >= PAIRS_A_PORTION:
                    yield found
                    found, checked = [], 0
                if (
                    other_south > north
                    or south > other_north
                    or other_west > east
                    or west > other_east
                    or other_first > last
                    or first > other_last
                    or drone_id == other_id
                ):
                    continue
                pair = (drone_id, other_id) if drone_id < other_id else (other_id, drone_id)
                if pair in seen or not wanted(pair):
                    continue
                if len(seen) >= most_pairs:
                    yield found
                    return
                seen.add(pair)
                found.append(pair)
    yield found


def _write(
    cells: dict[tuple[int, int], list[_Stay]], drone_id: DroneId, motion: Motion, bounds: SeparationBounds, now: float
) -> None:
    lat, lon, alt, north, east, up, at = motion
    drift = drift_m(motion, now)
    pad_m = bounds.horizontal_m / 2 + drift + _ROUNDING_M
    pad_up_m = bounds.vertical_m / 2 + drift / 2
    pad_deg = pad_m / METRES_PER_DEGREE
    scale_m = METRES_PER_DEGREE * cos(radians(min(abs(lat), _MAX_LAT_DEG)))
    age = now - at
    steps = 1 + int(hypot(north, east) * bounds.ahead_s / CELL_M)
    step_s = bounds.ahead_s / steps
    for step in range(steps):
        first = step * step_s
        last = first + step_s
        north_0, north_1 = north * (age + first), north * (age + last)
        east_0, east_1 = east * (age + first), east * (age + last)
        up_0, up_1 = up * (age + first), up * (age + last)
        if north_0 > north_1:
            north_0, north_1 = north_1, north_0
        if east_0 > east_1:
            east_0, east_1 = east_1, east_0
        if up_0 > up_1:
            up_0, up_1 = up_1, up_0
        low, high = alt + up_0 - pad_up_m, alt + up_1 + pad_up_m
        south = lat + north_0 / METRES_PER_DEGREE - pad_deg
        northern = lat + north_1 / METRES_PER_DEGREE + pad_deg
        west = lon + (east_0 - pad_m) / scale_m + 180.0
        eastern = lon + (east_1 + pad_m) / scale_m + 180.0
        for row in range(floor(south / _ROW_DEG), floor(northern / _ROW_DEG) + 1):
            columns = _columns(row)
            column_deg = 360.0 / columns
            for column in range(floor(west / column_deg), floor(eastern / column_deg) + 1):
                round_deg, column = divmod(column, columns)
                turn = 360.0 * round_deg
                stay = (low, high, first, last, south, northern, west - turn, eastern - turn, drone_id)
                cells.setdefault((row, column), []).append(stay)


_ROW_DEG: Final = CELL_M / METRES_PER_DEGREE


@lru_cache(maxsize=10_000)
def _columns(row: int) -> int:
    """Round the earth, none of them narrower than a cell."""
    lat = min(abs(row * _ROW_DEG), _MAX_LAT_DEG)
    return int(360.0 * METRES_PER_DEGREE * cos(radians(lat)) / CELL_M)
