"""Finds four-sided outlines in a grey picture: blur, Canny, contours, `approxPolyDP`, then lines fitted to sides."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

Grey = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float64]

_POLYGON_SHARES: Final = (0.025, 0.05)
"""Permitted deviations of the polygon, as shares of the contour's length; the first with 4 to 6 edges is taken."""
_MIN_ROUNDNESS: Final = 0.35
"""16 areas per squared length: 1 of a square, 0.8 of a rectangle of 1 to 2.5, less with ragged edges."""
_LINE_SHARE: Final = 0.12
"""Left out at both ends of a side: blur rounds the corners."""


@dataclass(frozen=True, slots=True)
class QuadrilateralLimits:
    """`min_side_px`, `max_side_share`: of the mean side, the second of the picture's longer edge. `min_solidity`: the
    contour's area divided by its hull's. `max_aspect`: of opposite sides' means; a square tilted by 60 degrees has 2.
    `max_area_error`: relative difference between the areas of contour and fitted quadrilateral."""

    min_side_px: float = 8.0
    max_side_share: float = 0.95
    min_solidity: float = 0.88
    max_aspect: float = 2.5
    max_area_error: float = 0.14


@dataclass(frozen=True, slots=True)
class EdgePass:
    """One search: `scale` of the picture, `blur_px` (sigma, at that scale) and Canny's upper threshold; the lower is
    0.4 of it. `bridged`: gaps of a pixel in an edge are closed, at the price of edges closer than 4 pixels, which
    merge."""

    scale: float
    blur_px: float
    threshold: float
    bridged: bool = True


def normalised(picture: npt.NDArray[np.uint8]) -> Grey:
    """Converts (height, width) or (height, width, 3; blue, green, red) to grey, stretched so that the darkest and the
    brightest hundredth are black and white. A dull day then has the edges of a bright one."""
    grey = picture if picture.ndim == 2 else np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)
    sample = grey[::4, ::4]
    dark, bright = np.percentile(sample, (1, 99))
    # Below this range there is nothing but noise, which stretching would turn into edges.
    span = max(float(bright - dark), 24.0)
    levels = np.clip((np.arange(256) - dark) * (255.0 / span), 0.0, 255.0).astype(np.uint8)
    return np.asarray(cv2.LUT(grey, levels), np.uint8)


def find_quadrilaterals(grey: Grey, search: EdgePass, limits: QuadrilateralLimits) -> Floats:
    """Returns convex quadrilaterals (n, 4, 2) in pixels of `grey`, clockwise on the screen, the largest first. One edge
    in the picture usually gives two that nearly coincide."""
    small = grey
    if search.scale != 1.0:
        small = np.asarray(
            cv2.resize(grey, None, fx=search.scale, fy=search.scale, interpolation=cv2.INTER_AREA), np.uint8
        )
    blurred = cv2.GaussianBlur(small, (0, 0), search.blur_px)
    edges = cv2.Canny(blurred, 0.4 * search.threshold, search.threshold, L2gradient=True)
    if search.bridged:
        edges = cv2.dilate(edges, np.ones((3, 3), np.uint8))
    contours, nesting = cv2.findContours(edges, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    spread_px = 1.0 if search.bridged else 0.0
    min_side_px = max(limits.min_side_px * search.scale, 6.0)
    max_side_px = limits.max_side_share * max(small.shape)
    found = []
    for number, contour in enumerate(contours):
        if len(contour) < 3.0 * min_side_px:
            continue
        area = cv2.contourArea(contour)
        if not (min_side_px * min_side_px / limits.max_aspect <= area <= max_side_px * max_side_px):
            continue
        if 16.0 * area < _MIN_ROUNDNESS * len(contour) ** 2:  # an open edge, followed there and back
            continue
        hull_area = cv2.contourArea(cv2.convexHull(contour))
        if area < limits.min_solidity * hull_area:
            continue
        quadrilateral = _fit(np.asarray(contour, np.int32), area, limits)
        if quadrilateral is not None:
            # The dilated edge's outside and inside (a hole has a parent) lie this far from the edge itself.
            is_hole = nesting[0][number][3] >= 0
            quadrilateral = grown(quadrilateral, spread_px if is_hole else -spread_px)
        if quadrilateral is not None:
            found.append((area, quadrilateral))
    found.sort(key=lambda one: -one[0])
    if not found:
        return np.empty((0, 4, 2))
    corners = np.array([quadrilateral for _, quadrilateral in found])
    # Pixel centres have whole numbers at both scales.
    return np.asarray((corners + 0.5) / search.scale - 0.5)


def _fit(contour: npt.NDArray[np.int32], area: float, limits: QuadrilateralLimits) -> Floats | None:
    polygon = _polygon(contour)
    if polygon is None:
        return None
    for corners in _four_corners(polygon):
        fitted = _on_lines(contour[:, 0, :].astype(np.float64), corners)
        if fitted is None:
            continue
        sides = np.linalg.norm(np.roll(fitted, -1, axis=0) - fitted, axis=1)
        pair = (sides[0] + sides[2], sides[1] + sides[3])
        if min(pair) <= 0.0 or max(pair) > limits.max_aspect * min(pair):
            continue
        if abs(_area(fitted) - area) <= limits.max_area_error * area:
            return fitted
    return None


def _polygon(contour: npt.NDArray[np.int32]) -> Floats | None:
    """Returns a convex polygon of 4 to 6 corners, clockwise on the screen."""
    length = cv2.arcLength(contour, True)
    for share in _POLYGON_SHARES:
        polygon = cv2.approxPolyDP(contour, share * length, True)
        if 4 <= len(polygon) <= 6 and cv2.isContourConvex(polygon):
            corners = polygon[:, 0, :].astype(np.float64)
            return corners if _area(corners) > 0.0 else corners[::-1]
    return None


def _area(corners: Floats) -> float:
    """Positive if clockwise on the screen, where y points down."""
    x, y = corners[:, 0], corners[:, 1]
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2.0


def _four_corners(polygon: Floats) -> Iterator[Floats]:
    """Yields the polygon with its shortest sides replaced by the meeting point of their neighbours, until four are
    left."""
    corners = polygon
    while len(corners) > 4:
        sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        corners = np.roll(corners, -int(np.argmin(sides)), axis=0)
        # The short side is now from corner 0 to corner 1.
        meeting = _meeting(corners[-1], corners[0] - corners[-1], corners[1], corners[2] - corners[1])
        if meeting is None:
            return
        corners = np.vstack([meeting, corners[2:]])
    yield corners


def _meeting(p: Floats, along_p: Floats, q: Floats, along_q: Floats) -> Floats | None:
    """Returns where two lines meet; None if they are nearly parallel."""
    cross = along_p[0] * along_q[1] - along_p[1] * along_q[0]
    if abs(cross) < 0.1 * float(np.hypot(*along_p) * np.hypot(*along_q)):
        return None
    gap = q - p
    return np.asarray(p + along_p * ((gap[0] * along_q[1] - gap[1] * along_q[0]) / cross))


def grown(corners: Floats, by_px: float) -> Floats | None:
    """Moves the sides of a quadrilateral (4, 2), clockwise on the screen, outwards. None if none is left."""
    if by_px == 0.0:
        return corners
    along = np.roll(corners, -1, axis=0) - corners
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    starts = corners + by_px * outward
    moved = [_meeting(starts[i - 1], along[i - 1], starts[i], along[i]) for i in range(4)]
    found = [corner for corner in moved if corner is not None]
    return np.array(found) if len(found) == 4 and _area(np.array(found)) > 0.0 else None


def _on_lines(points: Floats, corners: Floats) -> Floats | None:
    """Fits a line to the contour's points along each side, and returns where neighbours meet."""
    lines = []
    for number in range(4):
        start, end = corners[number], corners[(number + 1) % 4]
        along = end - start
        length = float(np.hypot(*along))
        if length < 3.0:
            return None
        along = along / length
        gap = points - start
        progress = gap @ along
        offset = np.abs(gap @ np.array([-along[1], along[0]]))
        near = (offset < max(0.05 * length, 1.6)) & (progress > _LINE_SHARE * length)
        near &= progress < (1.0 - _LINE_SHARE) * length
        side = points[near]
        if len(side) < max(4.0, 0.4 * length):
            return None
        vx, vy, x, y = cv2.fitLine(side.astype(np.float32), cv2.DIST_HUBER, 0, 0.01, 0.01).ravel()
        lines.append((np.array([x, y], np.float64), np.array([vx, vy], np.float64)))
    fitted = []
    for number in range(4):
        meeting = _meeting(*lines[number - 1], *lines[number])
        if meeting is None or float(np.hypot(*(meeting - corners[number]))) > 0.25 * max(8.0, float(np.ptp(corners))):
            return None
        fitted.append(meeting)
    return np.array(fitted)
