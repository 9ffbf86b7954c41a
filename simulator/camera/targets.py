"""Landing targets on the ground: concentric squares with a letter, for target finding in flight.

The plates lie flat, and each looks the same in every picture of a seed.
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
from simulator.target_pictures.textures import TEXTURE_PX, target

Picture = npt.NDArray[np.uint8]

USUAL_SIDE_M: Final = 1.2
MAX_SIDE_M: Final = 20.0
VISIBLE_M: Final = 150.0
SQUARES: Final = 4
MIN_PX: Final = 8


@dataclass(frozen=True, slots=True)
class GroundTarget:
    """`north_m`, `east_m`: its centre. `heading_deg`: of the letter's top, from north, clockwise. `number`: chooses its
    looks."""

    letter: str
    north_m: float
    east_m: float
    heading_deg: float
    side_m: float
    number: int


def parse_target(text: str) -> tuple[str, float, float, float, float]:
    """Parses `LETTER@LAT,LON[,HEADING[,SIDE]]` in degrees and metres. Raises ValueError."""
    letter, at, rest = text.partition("@")
    try:
        lat_deg, lon_deg, *more = (float(word) for word in rest.split(","))
        heading_deg, side_m = [*more, *(0.0, USUAL_SIDE_M)[len(more) :]]
    except ValueError:
        at = ""
    if not at or not (len(letter) == 1 and "A" <= letter <= "Z"):
        raise ValueError(f"{text!r} is not LETTER@LAT,LON[,HEADING[,SIDE]]")
    if not (abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0 and 0.1 <= side_m <= MAX_SIDE_M):
        raise ValueError(f"{text!r}: there is no such place, or its side is not 0.1 to {MAX_SIDE_M:g} m")
    return letter, lat_deg, lon_deg, heading_deg, side_m


@lru_cache(maxsize=64)
def _plate(letter: str, number: int) -> list[Picture]:
    """From the finest; each has half the resolution of the one before."""
    drawn = target(letter, SQUARES, np.random.default_rng([ord(letter), number])).pixels
    levels = [np.asarray(cv2.merge([drawn, drawn, drawn]), np.uint8)]
    while levels[-1].shape[0] > MIN_PX:
        half = levels[-1].shape[0] // 2
        levels.append(np.asarray(cv2.resize(levels[-1], (half, half), interpolation=cv2.INTER_AREA), np.uint8))
    return levels


def draw_targets(picture: Picture, view: View, targets: list[GroundTarget]) -> None:
    """Draws those that are in sight."""
    for one in targets:
        _draw(picture, view, one)


def _draw(picture: Picture, view: View, one: GroundTarget) -> None:
    heading = math.radians(one.heading_deg)
    up, right = np.array([math.cos(heading), math.sin(heading)]), np.array([-math.sin(heading), math.cos(heading)])
    middle, half = np.array([one.north_m, one.east_m]), one.side_m / 2
    flat = [middle + half * (a * up + b * right) for a, b in ((1, -1), (1, 1), (-1, 1), (-1, -1))]
    corners = np.array([(*corner, 0.0) for corner in flat])
    seen = cut(view.to_lens(corners), (0.0, 0.0, 1.0), NEAREST_M)
    if len(seen) < 3 or seen[:, 2].min() > VISIBLE_M:
        return
    outline = view.to_pixels(seen)
    left, top = (max(math.floor(edge), 0) for edge in outline.min(axis=0))
    right_px = min(math.ceil(outline[:, 0].max()) + 1, view.width)
    bottom = min(math.ceil(outline[:, 1].max()) + 1, view.height)
    if left >= right_px or top >= bottom or np.abs(outline).max() > MAX_OUTLINE_PX:
        return
    plates = _plate(one.letter, one.number)
    largest_px = one.side_m / float(seen[:, 2].min()) * view.focal_px
    plate = plates[min(max(math.floor(math.log2(TEXTURE_PX / largest_px)), 0), len(plates) - 1)]
    to_plate = _plane_to_plate(middle, up, right, one.side_m, plate.shape[0]) @ view.plane_to_texture(0.0, 1.0, 0.0)
    box, size = (left, top, right_px, bottom), (right_px - left, bottom - top)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    drawn = cv2.warpPerspective(plate, shifted(to_plate, box), size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    inside = np.zeros((size[1], size[0]), np.uint8)
    cv2.fillConvexPoly(inside, np.round((outline - (left, top)) * 16).astype(np.int32), 255, cv2.LINE_8, 4)
    cv2.copyTo(drawn, inside, picture[top:bottom, left:right_px])


def _plane_to_plate(middle: Floats, up: Floats, right: Floats, side_m: float, size_px: int) -> Floats:
    """Returns the transformation from metres east and south of the origin to pixels of a plate."""
    scale = size_px / side_m
    edge = size_px / 2 - 0.5
    # North is minus the second coordinate.
    return np.array(
        [
            [scale * right[1], -scale * right[0], edge - scale * float(right @ middle)],
            [-scale * up[1], scale * up[0], edge + scale * float(up @ middle)],
            [0.0, 0.0, 1.0],
        ]
    )
