"""Cuts the innermost square of a target out of a picture, upright but for quarter turns, and the ink out of it."""

from __future__ import annotations

from typing import Final, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from onboard_agent.vision.concentric_squares import mapped, unit_to_pixels
from onboard_agent.vision.quadrilaterals import Floats
from onboard_agent.vision.square_target import SquareTarget

PATCH_PX: Final = 128
SMOOTHING_PX: Final = 1.2
_INSIDE: Final = 0.92
"""Of the innermost square: without its edge, which blur widens."""
_BORDER_PX: Final = 7
MIN_CONTRAST: Final = 22.0
"""Of 255, in the strongest colour, between ink and ground."""
_MIN_AREA: Final = 0.004
"""Of the patch."""
_MAX_INK: Final = 0.62
_CORNERS: Final = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])

Ink = npt.NDArray[np.float32]
"""1 where there is ink, 0 where there is none."""


class Spot(NamedTuple):
    """A connected piece of ink in a patch: its box."""

    left: int
    top: int
    wide: int
    high: int
    area: int


def inner_patch(picture: npt.NDArray[np.uint8], target: SquareTarget) -> npt.NDArray[np.float32]:
    """Returns (PATCH_PX, PATCH_PX, 3): the first side of the target is up. Takes grey or blue, green, red."""
    colour = picture if picture.ndim == 3 else np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), np.uint8)
    half = target.shares[-1] * _INSIDE
    corners: Floats = mapped(unit_to_pixels(np.array(target.corners_px)), half * _CORNERS)
    last = PATCH_PX - 1.0
    to_patch = cv2.getPerspectiveTransform(
        corners.astype(np.float32), np.array([(0, 0), (last, 0), (last, last), (0, last)], np.float32)
    )
    warped = cv2.warpPerspective(
        colour, to_patch, (PATCH_PX, PATCH_PX), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(cv2.GaussianBlur(warped.astype(np.float32), (0, 0), SMOOTHING_PX), np.float32)


def ink_of(patch: npt.NDArray[np.float32]) -> Ink | None:
    """Returns how much each pixel differs from the ground, towards the colour of the ink. None if nothing does."""
    edge = np.concatenate(
        [
            patch[:_BORDER_PX].reshape(-1, 3),
            patch[-_BORDER_PX:].reshape(-1, 3),
            patch[:, :_BORDER_PX].reshape(-1, 3),
            patch[:, -_BORDER_PX:].reshape(-1, 3),
        ]
    )
    ground = np.median(edge, axis=0)
    differs = patch - ground
    strength = np.abs(differs).max(axis=2)
    inner = strength[_BORDER_PX:-_BORDER_PX, _BORDER_PX:-_BORDER_PX]
    level, _ = cv2.threshold(np.clip(inner, 0, 255).astype(np.uint8), 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    inked = strength > max(level, MIN_CONTRAST / 2)
    inked[:_BORDER_PX] = inked[-_BORDER_PX:] = False
    inked[:, :_BORDER_PX] = inked[:, -_BORDER_PX:] = False
    if inked.sum() < _MIN_AREA * PATCH_PX * PATCH_PX or inked.mean() > _MAX_INK:
        return None
    colour = np.median(differs[inked], axis=0)
    if float(np.abs(colour).max()) < MIN_CONTRAST:
        return None
    ink = differs @ colour / float(colour @ colour)
    return np.asarray(np.clip(ink, 0.0, 1.0), np.float32)


def spots_of(ink: Ink) -> list[Spot]:
    """Returns the pieces that are no specks; none at all if one of their size reaches over the patch's edge."""
    count, _, stats, _ = cv2.connectedComponentsWithStats((ink > 0.5).astype(np.uint8), connectivity=8)
    found: list[Spot] = []
    over_edge: list[Spot] = []
    high_px, wide_px = ink.shape
    for number in range(1, count):
        spot = Spot(*(int(value) for value in stats[number]))
        touches = spot.left <= 0 or spot.top <= 0 or spot.left + spot.wide >= wide_px or spot.top + spot.high >= high_px
        if spot.area >= _MIN_AREA * high_px * wide_px:
            (over_edge if touches else found).append(spot)
    largest = max((max(spot.wide, spot.high) for spot in found), default=0)
    if any(max(spot.wide, spot.high) >= 0.6 * largest for spot in over_edge):
        return []
    return [spot for spot in found if max(spot.wide, spot.high) >= 0.45 * largest]


def box_of(ink: Ink) -> Ink | None:
    """Returns the ink of the largest piece, in its box."""
    count, _, stats, _ = cv2.connectedComponentsWithStats((ink > 0.5).astype(np.uint8), connectivity=8)
    if count < 2:
        return None
    best = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    left, top, wide, high = (int(value) for value in stats[best][:4])
    return cut(ink, Spot(left, top, wide, high, 0))


def cut(ink: Ink, spot: Spot) -> Ink:
    """Returns the ink in a spot's box."""
    return ink[spot.top : spot.top + spot.high, spot.left : spot.left + spot.wide]
