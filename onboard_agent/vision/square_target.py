"""A landing target of concentric squares, as found in one picture. Pure: values only."""

from __future__ import annotations

from dataclasses import dataclass

Point = tuple[float, float]
"""Right and down from the centre of the picture's top left pixel."""


@dataclass(frozen=True, slots=True)
class SquareTarget:
    """`centre_px`: where the diagonals of the outermost square meet, its true centre under any tilt. `corners_px`: of
    that square, clockwise on the screen, from the corner at the left end of the side nearest to the picture's top.

    `side_px`: mean of its four sides. `heading_deg`: of that side's outward direction, from the picture's top,
    clockwise, in [-45, 45): squares look the same after a quarter turn; the letter resolves that. `shares`: sides of
    all squares as shares of the outermost, from 1 down. `confidence`: 0 to 1, a rank and no probability: more squares
    and a better common centre give more.
    """

    centre_px: Point
    side_px: float
    heading_deg: float
    corners_px: tuple[Point, Point, Point, Point]
    shares: tuple[float, ...]
    confidence: float

    @property
    def squares(self) -> int:
        return len(self.shares)
