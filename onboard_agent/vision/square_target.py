"""A landing target of concentric squares, as found in one picture. Pure: values only."""

from __future__ import annotations

from dataclasses import dataclass

Point = tuple[float, float]
"""Right and down from the centre of the picture's top left pixel."""


@dataclass(frozen=True, slots=True)
class SquareTarget:
    """`centre_px`: where the diagonals of the outermost square meet, its true centre under any tilt. `corners_px`: of
    that square, clockwise on the screen, from the corner at the left end of the side nearest to the picture's top.

    `side_px`: mean of its four sides. `headings_deg`: where the middles of the four sides lie from the centre, from the
    picture's top, clockwise, 0 to 360, the first for the side between the first two corners; under tilt they are not 90
    degrees apart. `shares`: sides of
    all squares as shares of the outermost, from 1 down. `confidence`: 0 to 1, a rank and no probability: more squares
    and a better common centre give more.
    """

    centre_px: Point
    side_px: float
    headings_deg: tuple[float, float, float, float]
    corners_px: tuple[Point, Point, Point, Point]
    shares: tuple[float, ...]
    confidence: float

    @property
    def heading_deg(self) -> float:
        """Of the first side, in [-45, 45): squares look the same after a quarter turn; the letter resolves that."""
        return (self.headings_deg[0] + 45.0) % 90.0 - 45.0

    @property
    def squares(self) -> int:
        return len(self.shares)
