"""Square pictures that lie flat on the ground: landing pads and targets."""

from __future__ import annotations

import math
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from simulator.camera.marks import MAX_OUTLINE_PX, NEAREST_M
from simulator.camera.view import Floats, View, cut, shifted

Picture = npt.NDArray[np.uint8]

MIN_PX: Final = 8
_VISIBLE_M: Final = 150.0


def levels_of(drawn: npt.NDArray[np.uint8]) -> list[Picture]:
    """Returns a square, grey or blue, green, red, in colour, from the finest: each level has half the resolution of the
    one before."""
    levels = [drawn if drawn.ndim == 3 else np.asarray(cv2.merge([drawn, drawn, drawn]), np.uint8)]
    while levels[-1].shape[0] > MIN_PX:
        half = levels[-1].shape[0] // 2
        levels.append(np.asarray(cv2.resize(levels[-1], (half, half), interpolation=cv2.INTER_AREA), np.uint8))
    return levels


def axes(heading_deg: float) -> tuple[Floats, Floats]:
    """Returns the unit vectors (north, east) of the top and the right of a picture whose top has this heading."""
    heading = math.radians(heading_deg)
    return np.array([math.cos(heading), math.sin(heading)]), np.array([-math.sin(heading), math.cos(heading)])


def draw_flat(
    picture: Picture, view: View, levels: list[Picture], at: tuple[Floats, Floats, Floats], side_m: float
) -> None:
    """Draws a square picture that lies flat, if it is in sight. `at`: centre, and unit vectors of its top and its right
    (north, east)."""
    middle, up, right = at
    flat = [middle + side_m / 2 * (a * up + b * right) for a, b in ((1, -1), (1, 1), (-1, 1), (-1, -1))]
    seen = cut(view.to_lens(np.array([(*corner, 0.0) for corner in flat])), (0.0, 0.0, 1.0), NEAREST_M)
    if len(seen) < 3 or seen[:, 2].min() > _VISIBLE_M:
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
