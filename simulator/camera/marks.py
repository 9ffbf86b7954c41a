"""The pads on the ground where drones start: a white ring and the drone's number, on grey."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from simulator.camera.view import View, cut, shifted

Picture = npt.NDArray[np.uint8]

PAD_M = 5.0
"""From edge to edge."""
PAD_PX = 512
VISIBLE_M = 300.0
MAX_MARKS = 12
"""The number of marks drawn, nearest first."""
NEAREST_M = 0.05
MAX_OUTLINE_PX = 100_000.0
"""Distance from the picture; the drawing functions count in 32 bits."""
GREY, WHITE, ORANGE = (96, 98, 98), (238, 240, 240), (48, 120, 236)


@dataclass(frozen=True, slots=True)
class Mark:
    north_m: float
    east_m: float
    text: str


@lru_cache(maxsize=64)
def _pad(text: str) -> list[Picture]:
    """From the finest; each has half the resolution of the one before."""
    pad = np.zeros((PAD_PX, PAD_PX, 3), np.uint8)
    pad[:] = GREY
    middle = (PAD_PX // 2, PAD_PX // 2)
    cv2.circle(pad, middle, 236, ORANGE, 22, cv2.LINE_AA)
    cv2.circle(pad, middle, 190, WHITE, 26, cv2.LINE_AA)
    scale = 7.4 if len(text) == 1 else 5.0 if len(text) == 2 else 3.4
    (wide, high), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, 34)
    at = (middle[0] - wide // 2, middle[1] + high // 2)
    cv2.putText(pad, text, at, cv2.FONT_HERSHEY_SIMPLEX, scale, WHITE, 34, cv2.LINE_AA)
    levels = [pad]
    while levels[-1].shape[0] > 16:
        half = levels[-1].shape[0] // 2
        levels.append(np.asarray(cv2.resize(levels[-1], (half, half), interpolation=cv2.INTER_AREA), np.uint8))
    return levels


def draw_marks(picture: Picture, view: View, marks: list[Mark]) -> None:
    """North is up on each."""
    by_distance = sorted(marks, key=lambda mark: math.hypot(mark.north_m - view.eye[0], mark.east_m - view.eye[1]))
    for mark in reversed(by_distance[:MAX_MARKS]):
        _draw_mark(picture, view, mark)


def _draw_mark(picture: Picture, view: View, mark: Mark) -> None:
    half = PAD_M / 2
    north, east = mark.north_m, mark.east_m
    corners = np.array([(north + a * half, east + b * half, 0.0) for a, b in ((1, -1), (1, 1), (-1, 1), (-1, -1))])
    seen = cut(view.to_lens(corners), (0.0, 0.0, 1.0), NEAREST_M)
    if len(seen) < 3 or seen[:, 2].min() > VISIBLE_M:
        return
    outline = view.to_pixels(seen)
    left, top = (max(math.floor(edge), 0) for edge in outline.min(axis=0))
    right = min(math.ceil(outline[:, 0].max()) + 1, view.width)
    bottom = min(math.ceil(outline[:, 1].max()) + 1, view.height)
    if left >= right or top >= bottom or np.abs(outline).max() > MAX_OUTLINE_PX:
        return
    pads = _pad(mark.text)
    largest_px = PAD_M / float(seen[:, 2].min()) * view.focal_px
    pad = pads[min(max(math.floor(math.log2(PAD_PX / largest_px)), 0), len(pads) - 1)]
    texel_m = PAD_M / pad.shape[0]
    to_pad = view.plane_to_texture(0.0, texel_m, pad.shape[0] / 2)
    to_pad[0] -= (east / texel_m + 0.5) * to_pad[2]
    to_pad[1] += (north / texel_m - 0.5) * to_pad[2]
    box = (left, top, right, bottom)
    size = (right - left, bottom - top)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    drawn = cv2.warpPerspective(pad, shifted(to_pad, box), size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    inside = np.zeros((size[1], size[0]), np.uint8)
    cv2.fillConvexPoly(inside, np.round((outline - (left, top)) * 16).astype(np.int32), 255, cv2.LINE_8, 4)
    cv2.copyTo(drawn, inside, picture[top:bottom, left:right])
