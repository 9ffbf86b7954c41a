"""The ground in the picture: cut from the map, coarser with distance so that nothing flickers, then hazy."""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt

from simulator.camera.ground_map import GRAIN_PX, GRAIN_TEXEL_M, LEVELS, SIZE_PX, TEXEL_M, GroundMap
from simulator.camera.sky import HAZE
from simulator.camera.view import Box, Floats, View, dips, shifted

Picture = npt.NDArray[np.uint8]

HORIZON_DIP = 0.002
"""Anything farther is haze."""
FADES_AT = 0.85
"""Share of the distance up to which a level is sharp enough: from there on it fades into the next."""

HAZE_FROM_M = 250.0
HALF_HAZY_M = 1300.0
GRAIN_TO_M = 45.0
"""Not visible beyond this distance."""
GRAIN_FULL_M = 18.0


def draw_ground(picture: Picture, view: View, ground: GroundMap) -> None:
    """Draws everything below the horizon."""
    far_m = min(view.eye_height_m / HORIZON_DIP, _sharp_to_m(view, LEVELS - 1))
    fade_m = far_m / 2
    for level in range(LEVELS - 1, -1, -1):
        # A level is drawn over the coarser one, and fades into it before it would begin to flicker.
        sharp_m = _sharp_to_m(view, level)
        if level < LEVELS - 1:
            far_m = min(sharp_m, far_m)
            fade_m = far_m * FADES_AT
        near_m = _sharp_to_m(view, level - 1) * FADES_AT if level > 0 else 0.0
        reach = _Reach(view.eye_height_m, near_m, far_m, fade_m)
        for box in view.boxes_where(reach.from_dip, reach.to_dip):
            _draw_level(picture, view, ground, level, reach, box)
    for box in view.boxes_where(view.eye_height_m / GRAIN_TO_M, math.inf):
        _add_grain(picture, view, ground, box)
    for box in view.boxes_where(0.0, view.eye_height_m / HAZE_FROM_M):
        _add_haze(picture, view, box)


class _Reach:
    """The range in which a level is drawn, and where it becomes opaque, as dips."""

    def __init__(self, eye_height_m: float, near_m: float, far_m: float, fade_m: float) -> None:
        self.from_dip = eye_height_m / far_m
        self.whole_dip = eye_height_m / fade_m
        self.to_dip = eye_height_m / near_m if near_m > 0.0 else math.inf


def _sharp_to_m(view: View, level: int) -> float:
    """Returns the distance at which a pixel covers as much ground as one pixel of that level. On slanting ground a
    pixel covers more along than across; this uses the mean of the two."""
    return float((TEXEL_M * 2.0**level * view.focal_px) ** (2 / 3) * view.eye_height_m ** (1 / 3))


def _draw_level(picture: Picture, view: View, ground: GroundMap, level: int, reach: _Reach, box: Box) -> None:
    to_map = view.plane_to_texture(0.0, TEXEL_M * 2**level, SIZE_PX / 2 / 2**level)
    # A coarse pixel has its origin at its centre, too.
    to_map[0] -= 0.5 * to_map[2]
    to_map[1] -= 0.5 * to_map[2]
    drawn = _cut_out(ground.levels[level], to_map, box)
    _fade(drawn, picture, view, box, (reach.from_dip, reach.whole_dip))
    left, top, right, bottom = box
    picture[top:bottom, left:right] = drawn


def _fade(drawn: Picture, below: Picture | int, view: View, box: Box, dips_between: tuple[float, float]) -> None:
    """Fades `drawn` into the level below, or into one grey, where a pixel's dip lies between the two."""
    none_at, whole_at = dips_between
    left, top, right, bottom = box
    a, b, c = view.dip
    if b > 0.0:  # unless nearly upside down: the lower rows are opaque
        least = c + min(a * left, a * (right - 1))
        bottom = min(max(math.ceil((whole_at - least) / b), top), bottom)
    if bottom == top:
        return
    box = (left, top, right, bottom)
    part = drawn[: bottom - top]
    weight = dips(view, box)
    weight -= none_at
    weight /= whole_at - none_at
    np.clip(weight, 0.0, 1.0, out=weight)
    other = np.full_like(part, below) if isinstance(below, int) else below[top:bottom, left:right]
    part[:] = cv2.blendLinear(part, other, weight, 1.0 - weight)


def _cut_out(map_: Picture, to_map: Floats, box: Box) -> Picture:
    left, top, right, bottom = box
    return np.asarray(
        cv2.warpPerspective(
            map_,
            shifted(to_map, box),
            (right - left, bottom - top),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_WRAP,
        ),
        np.uint8,
    )


def _add_grain(picture: Picture, view: View, ground: GroundMap, box: Box) -> None:
    grain = _cut_out(ground.grain, view.plane_to_texture(0.0, GRAIN_TEXEL_M, GRAIN_PX / 2), box)
    _fade(grain, 128, view, box, (view.eye_height_m / GRAIN_TO_M, view.eye_height_m / GRAIN_FULL_M))
    left, top, right, bottom = box
    part = picture[top:bottom, left:right]
    part[:] = cv2.addWeighted(part, 1.0, cv2.merge([grain, grain, grain]), 1.0, -128.0)


def _add_haze(picture: Picture, view: View, box: Box) -> None:
    dip = dips(view, box)
    clear = np.exp2((HAZE_FROM_M - view.eye_height_m / np.maximum(dip, 1e-6)) / HALF_HAZY_M)
    clear[dip <= 0.0] = 1.0  # the sky is drawn separately
    np.clip(clear, 0.0, 1.0, out=clear)
    left, top, right, bottom = box
    part = picture[top:bottom, left:right]
    haze = np.empty_like(part)
    haze[:] = HAZE
    part[:] = cv2.blendLinear(part, haze, clear, 1.0 - clear)


def haze_at(distance_m: float) -> float:
    """Returns the share of haze at this distance, 0 to 1."""
    return 1.0 - min(math.exp2((HAZE_FROM_M - distance_m) / HALF_HAZY_M), 1.0)
