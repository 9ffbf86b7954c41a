"""What a target looks like, as people lay it out: the setting `target` of the controller `challenge`. Pure.

squares                 three or more squares with one centre, of any colours and sizes
white 2, any 1          squares with one centre, from the outermost in: colour and side in metres
apriltag-36h11 7 0.5    a marker: family, number, and the side of its black square in metres
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Final

COLOURS: Final = ("any", "white", "black", "grey", "red", "orange", "yellow", "green", "blue", "purple")
MARKER_FAMILIES: Final = (
    "aruco-4x4-50",
    "aruco-5x5-100",
    "aruco-6x6-250",
    "aruco-original",
    "apriltag-16h5",
    "apriltag-25h9",
    "apriltag-36h11",
)
SQUARES: Final = "squares"
MAX_RINGS: Final = 6
MAX_SIDE_M: Final = 20.0
_MIN_STEP: Final = 0.08
"""Between two squares, as a share of the outermost: closer ones are one edge in a picture."""
FORM: Final = "squares, COLOUR METRES, COLOUR METRES... from the outermost in, or FAMILY NUMBER METRES"


class BadKind(ValueError):
    """One line for people."""


@dataclass(frozen=True, slots=True)
class Ring:
    """One square of a target, seen as a ring around the next one."""

    colour: str
    side_m: float


@dataclass(frozen=True, slots=True)
class Marker:
    """`family`: of `MARKER_FAMILIES`."""

    family: str
    number: int
    side_m: float


@dataclass(frozen=True, slots=True)
class TargetKind:
    """Without rings and marker: any three squares with one centre."""

    rings: tuple[Ring, ...] = ()
    marker: Marker | None = None

    @property
    def shares(self) -> tuple[float, ...]:
        """Sides of the rings as shares of the outermost."""
        return tuple(ring.side_m / self.rings[0].side_m for ring in self.rings)

    @property
    def has_text(self) -> bool:
        """Whether there may be characters in the innermost square."""
        return self.marker is None


def parse_kind(text: str) -> TargetKind:
    """Raises BadKind."""
    if text.strip() == SQUARES:
        return TargetKind()
    words = text.split()
    if words and words[0] in MARKER_FAMILIES:
        return TargetKind(marker=_marker(words))
    rings = tuple(_ring(part) for part in text.split(","))
    if not 2 <= len(rings) <= MAX_RINGS:
        raise BadKind(f"target: {text!r} has not 2 to {MAX_RINGS} squares")
    for outer, inner in itertools.pairwise(rings):
        if outer.side_m - inner.side_m < _MIN_STEP * rings[0].side_m:
            raise BadKind(f"target: in {text!r} a square is not clearly smaller than the one around it")
        if outer.colour == inner.colour != "any":
            raise BadKind(f"target: in {text!r} a square has the colour of the one around it")
    return TargetKind(rings)


def _marker(words: list[str]) -> Marker:
    try:
        family, number, side_m = words[0], int(words[1]), float(words[2])
    except (IndexError, ValueError):
        number, side_m = -1, 0.0
    if len(words) != 3 or number < 0 or not 0.02 <= side_m <= MAX_SIDE_M:
        raise BadKind(f"target: {' '.join(words)!r} is not FAMILY NUMBER METRES, such as apriltag-36h11 7 0.5")
    return Marker(family, number, side_m)


def _ring(part: str) -> Ring:
    try:
        colour, side = part.split()
        ring = Ring(colour, float(side))
    except ValueError:
        raise BadKind(f"target: {part.strip()!r} is not {FORM}") from None
    if ring.colour not in COLOURS:
        raise BadKind(f"target: {ring.colour!r} is none of {', '.join(COLOURS)}")
    if not 0.05 <= ring.side_m <= MAX_SIDE_M:
        raise BadKind(f"target: a side is 0.05 to {MAX_SIDE_M:g} m, not {ring.side_m:g}")
    return ring
