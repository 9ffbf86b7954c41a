"""Landing pads on the ground: ArUco markers on white boards, for precision landing in flight.

A pad has a place to touch down and several markers around it, because a large one leaves the picture close to the
ground and a small one is too small from far above.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import cv2
import numpy as np

from simulator.camera.flat_pictures import Picture, axes, draw_flat, levels_of
from simulator.camera.view import View

FAMILY: Final = cv2.aruco.DICT_4X4_50
CELLS: Final = 6
"""Of a marker with its black border; one more on each side is white."""
CELL_PX: Final = 48
BOARD_CELLS: Final = CELLS + 2
WHITE, BLACK_LEVEL = 232, 24


@dataclass(frozen=True, slots=True)
class PadMarker:
    """`side_m`: of the black square. `right_m`, `up_m`: its centre from the pad's place, in the marker's own axes."""

    number: int
    side_m: float
    right_m: float = 0.0
    up_m: float = 0.0


USUAL_MARKERS: Final = (PadMarker(0, 1.0, 0.0, 0.85), PadMarker(1, 0.16))


@dataclass(frozen=True, slots=True)
class LandingPad:
    """`north_m`, `east_m`: where to touch down. `heading_deg`: of the markers' tops, from north, clockwise."""

    north_m: float
    east_m: float
    heading_deg: float = 0.0
    markers: tuple[PadMarker, ...] = USUAL_MARKERS


def parse_pad(text: str) -> tuple[float, float, float]:
    """Parses `LAT,LON[,HEADING]` in degrees. Raises ValueError."""
    try:
        lat_deg, lon_deg, *more = (float(word) for word in text.split(","))
        (heading_deg,) = more or (0.0,)
    except ValueError:
        raise ValueError(f"{text!r} is not LAT,LON[,HEADING]") from None
    if not (abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0 and math.isfinite(heading_deg)):
        raise ValueError(f"{text!r}: there is no such place")
    return lat_deg, lon_deg, heading_deg


@lru_cache(maxsize=64)
def _board(number: int) -> list[Picture]:
    cells = np.full((BOARD_CELLS, BOARD_CELLS), WHITE, np.uint8)
    drawn = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(FAMILY), number, CELLS)
    cells[1:-1, 1:-1] = np.where(np.asarray(drawn) > 0, WHITE, BLACK_LEVEL)
    fine = np.repeat(np.repeat(cells, CELL_PX, axis=0), CELL_PX, axis=1)
    return levels_of(fine)


def draw_pads(picture: Picture, view: View, pads: list[LandingPad]) -> None:
    """Draws the markers that are in sight."""
    for pad in pads:
        up, right = axes(pad.heading_deg)
        for marker in pad.markers:
            middle = np.array([pad.north_m, pad.east_m]) + marker.up_m * up + marker.right_m * right
            side_m = marker.side_m * BOARD_CELLS / CELLS
            draw_flat(picture, view, _board(marker.number), (middle, up, right), side_m)
