"""Finds a target of which the squares are known: each outline in the picture may be one of them, and says where the
others must be. There the colour must step, along all four sides, and nowhere between."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from onboard_agent.vision.character_reader import CharacterReader
from onboard_agent.vision.concentric_squares import (
    PASSES,
    diagonal_meetings,
    homography_to_unit,
    mapped,
    square_target,
    unit_to_pixels,
)
from onboard_agent.vision.markers import MarkerDetector
from onboard_agent.vision.quadrilaterals import (
    EdgePass,
    Floats,
    QuadrilateralLimits,
    find_quadrilaterals,
    normalised,
)
from onboard_agent.vision.square_target import SquareTarget
from onboard_agent.vision.target_kind import TargetKind

Picture = npt.NDArray[np.uint8]
MAX_OUTLINES: Final = 160
"""Per picture, the largest."""
MIN_LIKENESS: Final = 0.08
"""Of what is in the innermost square to characters. What cannot be read may be a target; a window is none."""
_MARKERS: Final = ("aruco-4x4-50", "aruco-5x5-100", "aruco-6x6-250", "apriltag-25h9", "apriltag-36h11")
"""Those that no letter is ever taken for."""
_MARKER_PX: Final = 200
_SAMPLES: Final = 14
"""Along each side."""
_ALONG: Final = np.linspace(-0.9, 0.9, _SAMPLES)
_UNIT: Final = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
_NEAR_PX: Final = 2.2
_NEAR_SHARE: Final = 0.16
"""How far beside an edge is looked: so many pixels, and this share of the way to the next one."""


@dataclass(frozen=True, slots=True)
class RingLimits:
    """`min_target_px`: side of the outermost square. `min_step`: of 255, in the strongest colour, from one ring to the
    next. `min_sides`: the share of places along the edges of a ring where its colour steps; `min_outer`: the same
    against the ground, which may have the target's colour in part. `max_unlike`: within a ring, as a share of the
    step. `max_white`: saturation of what is white, grey or black."""

    min_target_px: float = 24.0
    min_step: float = 16.0
    min_sides: float = 0.86
    min_outer: float = 0.72
    max_unlike: float = 0.45
    max_white: float = 0.3


class _Fit(NamedTuple):
    corners: Floats
    score: float


class RingDetector:
    """Keeps no state between pictures."""

    def __init__(self, kind: TargetKind, limits: RingLimits | None = None) -> None:
        assert len(kind.rings) >= 2
        self._kind = kind
        self._limits = limits or RingLimits()
        self._shares = np.array(kind.shares)
        self._points = _points()
        self._reader = CharacterReader()
        self._markers = [MarkerDetector(family) for family in _MARKERS]

    def find(self, picture: Picture) -> list[SquareTarget]:
        """Takes (height, width) grey or (height, width, 3) blue, green, red. Returns targets, the surest first."""
        colour = picture if picture.ndim == 3 else np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), np.uint8)
        smooth = cv2.GaussianBlur(colour, (0, 0), 0.8).astype(np.float32)
        smooth *= 255.0 / max(float(np.percentile(smooth[::4, ::4].max(axis=2), 99)), 24.0)
        grey = normalised(colour)
        chroma = normalised(np.asarray(colour.max(axis=2) - colour.min(axis=2), np.uint8))
        outlines = np.empty((0, 4, 2))
        for search in PASSES:
            outlines = self._outlines((grey, chroma), search)
            fits = [fit for outline in outlines for fit in self._fits(outline, smooth)]
            found = [one for one in self._targets(fits) if self._has_text(colour, one)]
            if found:
                return found
        return []

    def _outlines(self, layers: tuple[Picture, Picture], search: EdgePass) -> Floats:
        limits = QuadrilateralLimits()
        found = np.concatenate([find_quadrilaterals(layer, search, limits) for layer in layers])
        sides = np.linalg.norm(np.roll(found, -1, axis=1) - found, axis=2).mean(axis=1)
        found = found[np.argsort(-sides)]
        kept: list[Floats] = []
        for outline in found:
            # The same edge is found in both layers, and from both of its sides.
            if all(np.abs(outline - other).max() > 1.0 for other in kept):
                kept.append(outline)
            if len(kept) == MAX_OUTLINES:
                break
        return np.array(kept).reshape(-1, 4, 2)

    def _fits(self, outline: Floats, smooth: npt.NDArray[np.float32]) -> list[_Fit]:
        """Returns the outermost squares that this outline, as one of the rings, implies, and that the picture shows."""
        to_unit = homography_to_unit(outline)
        if to_unit is None:
            return []
        from_unit = np.linalg.inv(to_unit)
        side_px = float(np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1).mean())
        found = []
        for share in self._shares:
            if side_px / share < self._limits.min_target_px:
                continue
            grown: Floats = np.asarray(from_unit @ np.diag([1.0 / share, 1.0 / share, 1.0]), np.float64)
            corners = mapped(grown, _UNIT)
            high, wide = smooth.shape[:2]
            if (corners < -2.0).any() or (corners[:, 0] > wide + 1).any() or (corners[:, 1] > high + 1).any():
                continue
            score = self._score(grown, side_px / share / 2.0, smooth)
            if score > 0.0:
                found.append(_Fit(corners, score))
        return found

    def _score(self, from_unit: Floats, half_px: float, smooth: npt.NDArray[np.float32]) -> float:
        """Returns 0 to 1; 0: it is none."""
        limits = self._limits
        rings = len(self._shares)
        near = np.maximum(_NEAR_PX / half_px, _NEAR_SHARE * _gaps(self._shares))
        # Of each ring: outside its edge, inside its edge, and half way to the next one.
        halves = np.concatenate([self._shares + near, self._shares - near, _middles(self._shares)])
        points = self._points[None] * halves[:, None, None, None]
        whole = points @ from_unit[:, :2].T + from_unit[:, 2]
        if (whole[..., 2] <= 1e-6).any():
            return 0.0
        pixels = np.rint(whole[..., :2] / whole[..., 2:]).astype(np.int64)
        high, wide = smooth.shape[:2]
        seen = smooth[pixels[..., 1].clip(0, high - 1), pixels[..., 0].clip(0, wide - 1)]
        outside, inside, middle = seen[:rings], seen[rings : 2 * rings], seen[2 * rings :]
        steps = inside - outside
        """(rings, sides, samples, colours)"""
        score = 1.0
        for ring in range(rings):
            usual = np.median(steps[ring].reshape(-1, 3), axis=0)
            strength = float(np.abs(usual).max())
            if ring and strength < limits.min_step:
                return 0.0
            if ring:
                along = steps[ring] @ usual / max(float(usual @ usual), 1e-6)
                share = float((along > 0.4).mean())
                sides = float((along > 0.4).mean(axis=1).min())
            else:
                # The ground has many colours: any step will do.
                clear = np.abs(steps[ring]).max(axis=2) > 0.6 * limits.min_step
                share, sides = float(clear.mean()), float(np.sort(clear.mean(axis=1))[1])
            if share < (limits.min_sides if ring else limits.min_outer) or sides < 0.6:
                return 0.0
            score *= share
        for ring in range(rings - 1):
            # Within a ring there is one colour: from its outer edge to its middle and its inner edge.
            step = float(np.abs(np.median(steps[ring + 1].reshape(-1, 3), axis=0)).max())
            for other in (middle[ring], outside[ring + 1]):
                unlike = np.abs(other - inside[ring]).max(axis=2) > limits.max_unlike * max(step, limits.min_step)
                if float(unlike.mean()) > 0.2:
                    return 0.0
                score *= 1.0 - float(unlike.mean())
        colours = [np.median(inside[ring].reshape(-1, 3), axis=0) for ring in range(rings)]
        ground = np.median(outside[0].reshape(-1, 3), axis=0)
        return score if self._has_colours(colours, ground) else 0.0

    def _has_colours(self, seen: list[npt.NDArray[np.float32]], ground: npt.NDArray[np.float32]) -> bool:
        wanted = [ring.colour for ring in self._kind.rings]
        whites = [colour for colour, name in zip(seen, wanted, strict=True) if name == "white"]
        balance: npt.NDArray[np.float32] = np.ones(3, np.float32)
        if whites:
            # What is white shows the colour of the light.
            white = whites[0]
            if _saturation(white) > self._limits.max_white or float(white.max()) < float(ground.max()) - 25.0:
                return False
            balance = np.asarray(float(white.max()) / np.maximum(white, 1.0), np.float32)
        brightest = max(float(colour.max()) for colour in seen)
        return all(
            name == "any" or _is_colour(colour * balance, name, brightest, self._limits.max_white)
            for colour, name in zip(seen, wanted, strict=True)
        )

    def _has_text(self, colour: Picture, target: SquareTarget) -> bool:
        """Whether there is something like characters in the innermost square, and no marker."""
        if self._reader.likeness(colour, target) < MIN_LIKENESS:
            return False
        grown = mapped(unit_to_pixels(np.array(target.corners_px)), 1.4 * target.shares[-1] * _UNIT)
        last = _MARKER_PX - 1.0
        sheet = np.array([(0, 0), (last, 0), (last, last), (0, last)], np.float32)
        to_patch = cv2.getPerspectiveTransform(grown.astype(np.float32), sheet)
        patch = cv2.warpPerspective(colour, to_patch, (_MARKER_PX, _MARKER_PX), flags=cv2.INTER_LINEAR)
        return not any(detector.find(np.asarray(patch, np.uint8)) for detector in self._markers)

    def _targets(self, fits: list[_Fit]) -> list[SquareTarget]:
        """Returns one target for each place: the mean of the outlines that agree on it."""
        found: list[SquareTarget] = []
        left = sorted(fits, key=lambda fit: -fit.score)
        while left:
            best = left[0]
            side_px = float(np.linalg.norm(np.roll(best.corners, -1, axis=0) - best.corners, axis=1).mean())
            same: list[_Fit] = []
            other: list[_Fit] = []
            for fit in left:
                centre, middle = diagonal_meetings(np.array([fit.corners, best.corners]))
                (same if float(np.hypot(*(centre - middle))) < 0.5 * side_px else other).append(fit)
            close = [_aligned(fit.corners, best.corners) for fit in same if fit.score > 0.9 * best.score]
            agreeing = [corners for corners in close if np.abs(corners - best.corners).max() < 0.06 * side_px]
            found.append(square_target(np.mean(agreeing, axis=0), self._kind.shares, best.score))
            left = other
        return found


def _aligned(corners: Floats, other: Floats) -> Floats:
    """Outlines may begin at different corners."""
    return min((np.roll(corners, turn, axis=0) for turn in range(4)), key=lambda one: float(np.abs(one - other).sum()))


def _points() -> Floats:
    """Returns points (sides, samples, 2) on the square from -1 to 1."""
    ones = np.ones(_SAMPLES)
    sides = [(_ALONG, -ones), (ones, _ALONG), (_ALONG, ones), (-ones, _ALONG)]
    return np.array([np.stack(side, axis=-1) for side in sides])


def _gaps(shares: Floats) -> Floats:
    """Returns the way from each edge to the nearer of its neighbours."""
    between = -np.diff(shares)
    outer, inner = np.append(between[0], between), np.append(between, 0.3 * shares[-1])
    return np.asarray(np.minimum(outer, inner), np.float64)


def _middles(shares: Floats) -> Floats:
    return np.append((shares[:-1] + shares[1:]) / 2.0, 0.85 * shares[-1])


def _saturation(colour: npt.NDArray[np.float32]) -> float:
    return float((colour.max() - colour.min()) / max(float(colour.max()), 1.0))


_HUES: Final = {"red": (345.0, 18.0), "orange": (12.0, 44.0), "yellow": (40.0, 72.0), "green": (70.0, 172.0)} | {
    "blue": (172.0, 258.0),
    "purple": (250.0, 348.0),
}
"""From and to, in degrees; neighbours share a part."""


def _is_colour(colour: npt.NDArray[np.float32], name: str, brightest: float, max_white: float) -> bool:
    """`colour`: blue, green, red, in white light."""
    bright = float(colour.max()) / max(brightest, 1.0)
    if name in ("white", "grey", "black"):
        least, most = {"white": (0.6, 9.0), "grey": (0.2, 0.85), "black": (0.0, 0.45)}[name]
        return least <= bright <= most and (_saturation(colour) <= max_white or bright < 0.25)
    blue, green, red = (float(one) for one in colour)
    span = max(red, green, blue) - min(red, green, blue)
    if _saturation(colour) < 0.22 or span < 12.0:
        return False
    if red >= green and red >= blue:
        hue = 60.0 * ((green - blue) / span % 6.0)
    elif green >= blue:
        hue = 60.0 * ((blue - red) / span + 2.0)
    else:
        hue = 60.0 * ((red - green) / span + 4.0)
    low, high = _HUES[name]
    return low <= hue <= high if low < high else hue >= low or hue <= high
