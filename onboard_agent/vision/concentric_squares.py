"""Finds targets of concentric squares: quadrilaterals with one centre that one homography maps to parallel squares."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from onboard_agent.vision.quadrilaterals import (
    EdgePass,
    Floats,
    Grey,
    QuadrilateralLimits,
    find_quadrilaterals,
    normalised,
)
from onboard_agent.vision.square_profile import next_square
from onboard_agent.vision.square_target import Point, SquareTarget

PASSES: Final = (
    EdgePass(1.0, 1.4, 90.0),
    EdgePass(1.0, 1.1, 45.0, bridged=False),
    EdgePass(0.5, 1.0, 60.0),
)
"""Searches in turn, each only if those before found no target, except that their outlines are kept: fine and strong
edges, faint edges, and coarse ones that survive noise."""

MAX_OUTLINES: Final = 250
"""Per picture, the largest: the comparison is quadratic."""

MAX_ADDED: Final = 3
_SIDE_MIDDLES: Final = np.array([(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)])
_UNIT: Final = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


@dataclass(frozen=True, slots=True)
class SquareDetectorSettings:
    """`min_squares`: with one centre. `max_offset`: between centres, as a share of the outermost square's side.
    `max_skew`: of an inner square's corners from a parallel square, as a share of its half side. `min_gap_px`,
    `min_gap_share`: between the half sides of two squares; closer ones are the same edge found twice. `min_share`: of
    the smallest square, of the outermost; what is smaller belongs to the letter, some of which have square outlines."""

    min_squares: int = 3
    max_offset: float = 0.05
    max_skew: float = 0.16
    min_gap_px: float = 2.6
    min_gap_share: float = 0.05
    min_share: float = 0.34
    min_target_px: float = 24.0
    limits: QuadrilateralLimits = field(default_factory=QuadrilateralLimits)
    passes: tuple[EdgePass, ...] = PASSES

    def __post_init__(self) -> None:
        if self.min_squares < 2:
            raise ValueError("min_squares is to be 2 or more")


class _Group(NamedTuple):
    corners: Floats
    centre: Floats
    side_px: float
    shares: tuple[float, ...]
    skew: float
    offset: float


class ConcentricSquareDetector:
    """Keeps no state between pictures."""

    def __init__(self, settings: SquareDetectorSettings | None = None) -> None:
        self.settings = settings or SquareDetectorSettings()

    def find(self, picture: npt.NDArray[np.uint8]) -> list[SquareTarget]:
        """Takes (height, width) grey or (height, width, 3) blue, green, red. Returns targets, the surest first."""
        return self.find_in_grey(normalised(picture))

    def find_in_grey(self, grey: Grey) -> list[SquareTarget]:
        """Takes a picture from `normalised`."""
        outlines = np.empty((0, 4, 2))
        for search in self.settings.passes:
            outlines = np.concatenate([outlines, find_quadrilaterals(grey, search, self.settings.limits)])
            targets = self.group(outlines, grey)
            if targets:
                return targets
        return []

    def group(self, outlines: Floats, grey: Grey) -> list[SquareTarget]:
        """Returns the targets among quadrilaterals (n, 4, 2), each clockwise on the screen."""
        if len(outlines) < 2:
            return []
        sides = np.linalg.norm(np.roll(outlines, -1, axis=1) - outlines, axis=2).mean(axis=1)
        order = np.argsort(-sides)[:MAX_OUTLINES]
        outlines, sides = outlines[order], sides[order]
        centres = diagonal_meetings(outlines)
        apart = np.linalg.norm(centres[:, None] - centres[None], axis=2)
        close = np.triu(apart <= self.settings.max_offset * sides[:, None], 1).sum(axis=1)
        groups: list[_Group] = []
        tried: list[_Group] = []
        for number in np.flatnonzero((close >= 1) & (sides >= self.settings.min_target_px)):
            group = self._around(int(number), outlines, sides, centres)
            if group is None or any(_is_inside(group, other) for other in tried):
                continue
            group = self._with_outer_squares(group, grey)
            tried.append(group)
            if len(group.shares) >= self.settings.min_squares:
                groups.append(group)
        return [_target(group, self.settings) for group in _distinct(groups)]

    def _around(self, number: int, outlines: Floats, sides: Floats, centres: Floats) -> _Group | None:
        """Returns the group whose outermost square is that of this number."""
        settings, side_px = self.settings, float(sides[number])
        offsets = np.linalg.norm(centres[number:] - centres[number], axis=1) / side_px
        near = np.flatnonzero(offsets <= settings.max_offset) + number
        if len(near) < 2:
            return None
        to_unit = homography_to_unit(outlines[number])
        if to_unit is None:
            return None
        corners = mapped(to_unit, outlines[near])
        halves, skews = _as_squares(corners)
        fits = skews <= settings.max_skew + 2.0 * 1.5 / (side_px * np.maximum(halves, 0.05))
        gap = max(settings.min_gap_px * 2.0 / side_px, settings.min_gap_share)
        chosen: list[list[int]] = []
        last = math.inf
        for index in sorted(np.flatnonzero(fits), key=lambda at: -halves[at]):
            if not settings.min_share <= halves[index] <= 1.0 + gap:
                continue
            if last - halves[index] < gap and chosen:
                chosen[-1].append(int(index))
            else:
                chosen.append([int(index)])
                last = float(halves[index])
        if len(chosen) < 2:
            return None
        middle = float(np.mean(halves[chosen[0]]))
        shares = tuple(float(np.mean(halves[same])) / middle for same in chosen)
        outer = _common_outline([outlines[near[same]] for same in chosen], shares)
        kept = [same[0] for same in chosen[1:]]
        skew, offset = float(np.mean(skews[kept])), float(np.mean(offsets[near[kept] - number]))
        return _group(outer, (1.0, *shares[1:]), skew, offset)

    def _with_outer_squares(self, group: _Group, grey: Grey) -> _Group:
        """Returns the group with squares around it that have no closed outline."""
        for _ in range(MAX_ADDED):
            from_unit = unit_to_pixels(group.corners)
            half = next_square(grey, from_unit, group.side_px / 2)
            if half is None or group.shares[-1] / half < self.settings.min_share:
                break
            corners = mapped(from_unit, half * _UNIT)
            larger = _group(corners, (1.0, *(share / half for share in group.shares)), group.skew, group.offset)
            if larger is None:
                break
            group = larger
        return group


def _group(corners: Floats, shares: tuple[float, ...], skew: float, offset: float) -> _Group | None:
    if homography_to_unit(corners) is None:
        return None
    side_px = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).mean())
    return _Group(corners, diagonal_meetings(corners[None])[0], side_px, shares, skew, offset)


def _same_place(group: _Group, other: _Group) -> bool:
    return float(np.hypot(*(group.centre - other.centre))) <= 0.25 * max(group.side_px, other.side_px)


def diagonal_meetings(outlines: Floats) -> Floats:
    """Returns where the diagonals of quadrilaterals (n, 4, 2) meet: the image of a square's centre under any
    homography. The mean of the corners is that only without tilt."""
    p, q = outlines[:, 0], outlines[:, 1]
    along_p, along_q = outlines[:, 2] - p, outlines[:, 3] - q
    cross = along_p[:, 0] * along_q[:, 1] - along_p[:, 1] * along_q[:, 0]
    gap = q - p
    share = (gap[:, 0] * along_q[:, 1] - gap[:, 1] * along_q[:, 0]) / np.where(np.abs(cross) < 1e-9, 1e-9, cross)
    return np.asarray(p + along_p * share[:, None])


def homography_to_unit(corners: Floats) -> Floats | None:
    """Returns the homography (3, 3) from pixels to the square from -1 to 1, the first corner at (-1, -1). None if the
    corners span no area."""
    rows = []
    for (x, y), (u, v) in zip(corners, _UNIT, strict=True):
        rows.append([x, y, 1, 0, 0, 0, -u * x, -u * y])
        rows.append([0, 0, 0, x, y, 1, -v * x, -v * y])
    try:
        solved = np.linalg.solve(np.array(rows), _UNIT.ravel())
    except np.linalg.LinAlgError:
        return None
    return np.append(solved, 1.0).reshape(3, 3)


def unit_to_pixels(corners: Floats) -> Floats:
    """Returns the inverse of `homography_to_unit` of corners that have one."""
    to_unit = homography_to_unit(corners)
    assert to_unit is not None
    return np.asarray(np.linalg.inv(to_unit), np.float64)


def mapped(homography: Floats, outlines: Floats) -> Floats:
    whole = outlines @ homography[:, :2].T + homography[:, 2]
    return np.asarray(whole[..., :2] / whole[..., 2:])


def _as_squares(corners: Floats) -> tuple[Floats, Floats]:
    """Returns half sides and skews of outlines (n, 4, 2) in the plane of the square from -1 to 1."""
    # An outline may begin at any corner: turn each so that its first is the top left one.
    first = np.argmin(corners.sum(axis=2), axis=1)
    turned = corners[np.arange(len(corners))[:, None], (first[:, None] + np.arange(4)) % 4]
    halves = (turned * _UNIT).mean(axis=(1, 2))
    errors = np.linalg.norm(turned - halves[:, None, None] * _UNIT, axis=2).max(axis=1)
    return halves, errors / np.maximum(halves, 1e-6)


def _common_outline(squares: list[Floats], shares: tuple[float, ...]) -> Floats:
    """Returns the outermost outline that fits all squares best (least squares over their corners), each given as the
    outlines (n, 4, 2) of one edge. One outline that is off by a pixel turns a small square by degrees."""
    seen, true = [], []
    reference = squares[0][0]
    for outlines, share in zip(squares, shares, strict=True):
        for outline in outlines:
            # Outlines may begin at different corners.
            turns = [np.roll(outline, turn, axis=0) for turn in range(4)]
            middle = outline.mean(axis=0)
            aligned = min(
                turns, key=lambda turned: float(np.abs((turned - middle) / share - (reference - middle)).sum())
            )
            seen.append(aligned)
            true.append(share * _UNIT)
    to_pixels, _ = cv2.findHomography(np.concatenate(true), np.concatenate(seen), 0)
    return reference if to_pixels is None else mapped(np.asarray(to_pixels, np.float64), _UNIT)


def _is_inside(group: _Group, other: _Group) -> bool:
    """Whether the other has its squares and more."""
    return (
        _same_place(group, other)
        and len(group.shares) <= len(other.shares)
        and group.side_px * group.shares[-1] >= 0.9 * other.side_px * other.shares[-1]
    )


def _distinct(groups: list[_Group]) -> list[_Group]:
    """Of groups with one centre, keeps that with the most squares, which is also the larger one in doubt."""
    ordered = sorted(groups, key=lambda group: (-len(group.shares), -group.side_px))
    kept: list[_Group] = []
    for group in ordered:
        if not any(_same_place(group, other) for other in kept):
            kept.append(group)
    return kept


def _target(group: _Group, settings: SquareDetectorSettings) -> SquareTarget:
    surplus = len(group.shares) - settings.min_squares
    counted = 1.0 - 0.4 * 0.5**surplus
    centred = 1.0 - 0.5 * min(group.offset / settings.max_offset, 1.0)
    parallel = 1.0 - 0.5 * min(group.skew / settings.max_skew, 1.0)
    return square_target(group.corners, group.shares, counted * math.sqrt(centred * parallel))


def square_target(corners: Floats, shares: tuple[float, ...], confidence: float) -> SquareTarget:
    """Returns the target with this outermost square, clockwise on the screen from any corner."""
    centre = diagonal_meetings(corners[None])[0]
    # The sides' middles of the square itself, not of its image: only these show its directions under tilt.
    outward = mapped(unit_to_pixels(corners), _SIDE_MIDDLES) - centre
    headings = [math.degrees(math.atan2(x, -y)) for x, y in outward]
    top = min(range(4), key=lambda i: abs(headings[i]))
    side_px = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).mean())
    first, second, third, fourth = (headings[(top + i) % 4] % 360.0 for i in range(4))
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = ((float(x), float(y)) for x, y in np.roll(corners, -top, axis=0))
    points: tuple[Point, Point, Point, Point] = ((x0, y0), (x1, y1), (x2, y2), (x3, y3))
    place = (float(centre[0]), float(centre[1]))
    return SquareTarget(place, side_px, (first, second, third, fourth), points, shares, confidence)
