"""A survey: lanes, a photograph at each turn; rows as in REST, and as an ArduCopter returns them."""

from __future__ import annotations

from typing import Any, Final

LAT_E7: Final = 473_977_000
LON_E7: Final = 85_456_000
LANE_E7: Final = 900
"""Ten metres from lane to lane."""
WAY_E7: Final = 12_000
"""About 90 m along each."""

WAYPOINT: Final = 16
TAKEOFF: Final = 22
SPEED: Final = 178
PHOTOGRAPH: Final = 203


def survey(items: int, number: int) -> list[list[Any]]:
    """Returns this many items; another `number` is another plan, in every waypoint."""
    height_m = 20 + number % 80
    shift = number // 80
    rows: list[list[Any]] = [
        [TAKEOFF, 3, [0, 0, 0, 0], 0, 0, height_m, 1],
        [SPEED, 0, [1, 5, -1, 0], 0, 0, 0, 1],
    ]
    corner = 0
    while len(rows) < items:
        lane, end = corner // 2, (corner + corner // 2) % 2
        rows.append([WAYPOINT, 3, [0, 0, 0, 0], LAT_E7 + lane * LANE_E7 + shift, LON_E7 + end * WAY_E7, height_m, 1])
        if len(rows) < items:
            rows.append([PHOTOGRAPH, 0, [0, 0, 0, 0], 1, 0, 0, 1])
        corner += 1
    return rows[:items]
