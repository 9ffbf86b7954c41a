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
import numpy.typing as npt

from simulator.camera.marks import MAX_OUTLINE_PX, NEAREST_M
from simulator.camera.view import Floats, View, cut, shifted

Picture = npt.NDArray[np.uint8]

FAMILY: Final = cv2.aruco.DICT_4X4_50
CELLS: Final = 6
"""Of a marker with its black border; one more on each side is white."""
CELL_PX: Final = 48
BOARD_CELLS: Final = CELLS + 2
WHITE, BLACK_LEVEL = 232, 24
VISIBLE_M: Final = 100.0
MIN_PX: Final = 8


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
    """From the finest; each has half the resolution of the one before."""
    cells = np.full((BOARD_CELLS, BOARD_CELLS), WHITE, np.uint8)
    drawn = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(FAMILY), number, CELLS)
    cells[1:-1, 1:-1] = np.where(np.asarray(drawn) > 0, WHITE, BLACK_LEVEL)
    fine = np.repeat(np.repeat(cells, CELL_PX, axis=0), CELL_PX, axis=1)
    levels = [np.asarray(cv2.merge([fine, fine, fine]), np.uint8)]
    while levels[-1].shape[0] > MIN_PX:
        half = levels[-1].shape[0] // 2
        levels.append(np.asarray(cv2.resize(levels[-1], (half, half), interpolation=cv2.INTER_AREA), np.uint8))
    return levels


def draw_pads(picture: Picture, view: View, pads: list[LandingPad]) -> None:
    """Draws the markers that are in sight."""
    for pad in pads:
        heading = math.radians(pad.heading_deg)
        up, right = np.array([math.cos(heading), math.sin(heading)]), np.array([-math.sin(heading), math.cos(heading)])
        for marker in pad.markers:
            middle = np.array([pad.north_m, pad.east_m]) + marker.up_m * up + marker.right_m * right
            side_m = marker.side_m * BOARD_CELLS / CELLS
            draw_board(picture, view, _board(marker.number), (middle, up, right), side_m)


def draw_board(
    picture: Picture, view: View, levels: list[Picture], at: tuple[Floats, Floats, Floats], side_m: float
) -> None:
    """Draws a square texture that lies flat. `at`: centre, and unit vectors of its top and its right (north, east)."""
    middle, up, right = at
    flat = [middle + side_m / 2 * (a * up + b * right) for a, b in ((1, -1), (1, 1), (-1, 1), (-1, -1))]
    seen = cut(view.to_lens(np.array([(*corner, 0.0) for corner in flat])), (0.0, 0.0, 1.0), NEAREST_M)
    if len(seen) < 3 or seen[:, 2].min() > VISIBLE_M:
        return
    outline = view.to_pixels(seen)
    left, top = (max(math.floor(edge), 0) for edge in outline.min(axis=0))
    right_px = min(math.ceil(outline[:, 0].max()) + 1, view.width)
    bottom = min(math.ceil(outline[:, 1].max()) + 1, view.height)
    if left >= right_px or top >= bottom or np.abs(outline).max() > MAX_OUTLINE_PX:
        return
    largest_px = side_m / float(seen[:, 2].min()) * view.focal_px
    level = levels[min(max(math.floor(math.log2(levels[0].shape[0] / largest_px)), 0), len(levels) - 1)]
    scale, edge = level.shape[0] / side_m, level.shape[0] / 2 - 0.5
    # The plane's coordinates are metres east and south.
    to_level = np.array(
        [
            [scale * right[1], -scale * right[0], edge - scale * float(right @ middle)],
            [-scale * up[1], scale * up[0], edge + scale * float(up @ middle)],
            [0.0, 0.0, 1.0],
        ]
    ) @ view.plane_to_texture(0.0, 1.0, 0.0)
    box, size = (left, top, right_px, bottom), (right_px - left, bottom - top)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    drawn = cv2.warpPerspective(level, shifted(to_level, box), size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    inside = np.zeros((size[1], size[0]), np.uint8)
    cv2.fillConvexPoly(inside, np.round((outline - (left, top)) * 16).astype(np.int32), 255, cv2.LINE_8, 4)
    cv2.copyTo(drawn, inside, picture[top:bottom, left:right_px])
