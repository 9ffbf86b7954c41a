"""Everything above the horizon: a sky that pales towards it, drifting clouds, and distant hills."""

from __future__ import annotations

import math
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from simulator.camera.noise import cloudy
from simulator.camera.view import Box, View, dips, shifted

Picture = npt.NDArray[np.uint8]

HAZE = (214, 206, 196)
"""The colour of the far distance; blue, green, red."""
ZENITH = (208, 150, 92)
CLOUD = (246, 242, 238)
CLOUD_HEIGHT_M = 1200.0
CLOUD_TEXEL_M = 12.0
CLOUD_PX = 512
CLOUD_DRIFT_MPS = 6.0
"""Eastwards."""
HILLS = ((3.2, 5, (196, 176, 158)), (1.8, 9, (168, 146, 124)))
"""Height in degrees, number of waves, colour; the farther ones first."""
HILL_STEP_DEG = 2.0
BEHIND_DEG = 70.0
"""The hills are drawn this far to each side of the camera's heading."""
MIN_AHEAD = 0.08
HILL_FOOT_DIP = 0.012
CLOUDS_FROM_DIP = 0.04
"""Above the horizon."""


@lru_cache(maxsize=2)
def cloud_map(seed: int) -> npt.NDArray[np.float32]:
    """Returns the thickness, 0 to 1."""
    noise = cloudy(np.random.default_rng(seed + 2), CLOUD_PX, 6, 6)
    return np.asarray(np.clip(noise * 3.0 - 0.05, 0.0, 0.9), np.float32)


@lru_cache(maxsize=2)
def hill_heights(seed: int) -> list[npt.NDArray[np.float64]]:
    """Returns the heights in degrees all round, for each row of hills."""
    random = np.random.default_rng(seed + 3)
    around = np.arange(0.0, 360.0, HILL_STEP_DEG) / 180.0 * math.pi
    rows = []
    for height_deg, waves, _ in HILLS:
        total = np.zeros_like(around)
        for octave in range(4):
            total += np.sin(around * waves * 2**octave + random.uniform(0, 6.3)) * 0.6**octave
        rows.append(height_deg * (0.6 + 0.22 * total))
    return rows


@lru_cache(maxsize=1)
def _gradient() -> Picture:
    part = np.linspace(0.0, 1.0, 256)[:, None] ** 0.7
    colours = np.array(HAZE) * (1.0 - part) + np.array(ZENITH) * part
    return np.asarray(colours.astype(np.uint8)[:, None, :])


def draw_sky(picture: Picture, view: View, seed: int, now_s: float) -> None:
    """Draws everything above the horizon, and haze a little below it."""
    for box in view.boxes_where(-math.inf, 0.05):
        _air(picture, view, box)
    for box in view.boxes_where(-math.inf, -CLOUDS_FROM_DIP):
        _clouds(picture, view, box, seed, now_s)
    _hills(picture, view, seed)


def _air(picture: Picture, view: View, box: Box) -> None:
    left, top, right, bottom = box
    a, b, c = view.dip
    steep = -255.0 / 0.9
    move = np.array([[0.0, 0.0, 0.0], [a * steep, b * steep, (c + a * left + b * top) * steep]])
    picture[top:bottom, left:right] = cv2.warpAffine(
        _gradient(),
        move,
        (right - left, bottom - top),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )


def _clouds(picture: Picture, view: View, box: Box, seed: int, now_s: float) -> None:
    left, top, right, bottom = box
    to_map = view.plane_to_texture(CLOUD_HEIGHT_M, CLOUD_TEXEL_M, 0.0)
    to_map[0] -= now_s * CLOUD_DRIFT_MPS / CLOUD_TEXEL_M % CLOUD_PX * to_map[2]
    thick = cv2.warpPerspective(
        cloud_map(seed),
        shifted(to_map, box),
        (right - left, bottom - top),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_WRAP,
    )
    # Thin near the horizon, and none below it, where the same plane lies behind the camera.
    thick *= np.clip((-CLOUDS_FROM_DIP - dips(view, box)) * 4.0, 0.0, 1.0)
    part = picture[top:bottom, left:right]
    white = np.empty_like(part)
    white[:] = CLOUD
    part[:] = cv2.blendLinear(white, part, np.asarray(thick, np.float32), np.asarray(1.0 - thick, np.float32))


def _hills(picture: Picture, view: View, seed: int) -> None:
    ahead = view.turned[:, 2]
    middle = math.degrees(math.atan2(ahead[1], ahead[0]))
    first = math.floor((middle - BEHIND_DEG) / HILL_STEP_DEG)
    steps = np.arange(first, first + round(2 * BEHIND_DEG / HILL_STEP_DEG) + 2)
    azimuth = np.radians(steps * HILL_STEP_DEG)
    around = np.stack([np.cos(azimuth), np.sin(azimuth), np.full_like(azimuth, HILL_FOOT_DIP)], axis=1)
    foot = around @ view.turned
    for heights, (_, _, colour) in zip(hill_heights(seed), HILLS, strict=True):
        around[:, 2] = -np.tan(np.radians(heights[steps % len(heights)]))
        crest = around @ view.turned
        seen = (crest[:, 2] > MIN_AHEAD) & (foot[:, 2] > MIN_AHEAD)
        if seen.sum() < 2:
            continue
        outline = view.to_pixels(np.concatenate([crest[seen], foot[seen][::-1]]))
        cv2.fillPoly(picture, [np.round(outline * 16).astype(np.int32)], colour, cv2.LINE_AA, 4)
