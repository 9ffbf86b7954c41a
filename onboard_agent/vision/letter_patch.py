"""Cuts the innermost square of a target out of a picture, upright but for quarter turns, and the letter out of it."""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from onboard_agent.vision.concentric_squares import mapped, unit_to_pixels
from onboard_agent.vision.quadrilaterals import Floats, Grey
from onboard_agent.vision.square_target import SquareTarget

PATCH_PX: Final = 96
GLYPH_PX: Final = 32
_INSIDE: Final = 0.88
"""Of the innermost square: without its edge, which blur widens."""
_BORDER_PX: Final = 6
MIN_CONTRAST: Final = 20.0
_MIN_INK: Final = 0.015
_MAX_INK: Final = 0.6
_CORNERS: Final = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])

Glyph = npt.NDArray[np.float32]
"""(GLYPH_PX, GLYPH_PX); ink is 1, ground 0."""


def letter_patch(picture: npt.NDArray[np.uint8], target: SquareTarget) -> Grey:
    """Returns (PATCH_PX, PATCH_PX): the first side of the target is up. Takes grey or blue, green, red."""
    grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    half = target.shares[-1] * _INSIDE
    corners: Floats = mapped(unit_to_pixels(np.array(target.corners_px)), half * _CORNERS)
    last = PATCH_PX - 1.0
    to_patch = cv2.getPerspectiveTransform(
        corners.astype(np.float32), np.array([(0, 0), (last, 0), (last, last), (0, last)], np.float32)
    )
    warped = cv2.warpPerspective(grey, to_patch, (PATCH_PX, PATCH_PX), flags=cv2.INTER_CUBIC)
    return np.asarray(cv2.GaussianBlur(warped, (0, 0), 1.2), np.uint8)


def ink_of(patch: Grey) -> Grey | None:
    """Returns the letter alone, 255 on 0: the largest spot that differs from the border and does not touch it. None if
    there is none."""
    edge = np.concatenate([patch[:_BORDER_PX].ravel(), patch[-_BORDER_PX:].ravel(), patch[:, :_BORDER_PX].ravel()])
    ground = int(np.median(edge))
    differs = cv2.absdiff(patch, np.full_like(patch, ground))
    level, ink = cv2.threshold(differs, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    inked = differs[ink > 0]
    if inked.size == 0 or float(inked.mean()) < MIN_CONTRAST or level <= 0.0:
        return None
    count, labels, stats, _ = cv2.connectedComponentsWithStats(ink, connectivity=8)
    best, best_area = 0, int(_MIN_INK * PATCH_PX * PATCH_PX)
    for number in range(1, count):
        left, top, wide, high, area = (int(value) for value in stats[number])
        touches = left <= 0 or top <= 0 or left + wide >= PATCH_PX or top + high >= PATCH_PX
        if not touches and area > best_area and area < _MAX_INK * PATCH_PX * PATCH_PX:
            best, best_area = number, area
    if best == 0:
        return None
    return np.asarray((labels == best) * 255, np.uint8)


def glyph_of(ink: Grey) -> Glyph:
    """Scales a letter (255 on 0, not empty) to fill `GLYPH_PX` in its longer direction, in the middle."""
    left, top, wide, high = cv2.boundingRect(ink)
    inner = GLYPH_PX - 4
    factor = inner / max(wide, high)
    size = (max(round(wide * factor), 1), max(round(high * factor), 1))
    scaled = cv2.resize(ink[top : top + high, left : left + wide], size, interpolation=cv2.INTER_AREA)
    glyph = np.zeros((GLYPH_PX, GLYPH_PX), np.float32)
    x, y = (GLYPH_PX - size[0]) // 2, (GLYPH_PX - size[1]) // 2
    glyph[y : y + size[1], x : x + size[0]] = scaled.astype(np.float32) / 255.0
    return np.asarray(cv2.GaussianBlur(glyph, (0, 0), 0.8), np.float32)
