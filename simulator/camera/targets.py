"""Landing targets on the ground: concentric squares with a letter, for target finding in flight.

The plates lie flat, and each looks the same in every picture of a seed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from simulator.camera.flat_pictures import Picture, axes, draw_flat, levels_of
from simulator.camera.view import View
from simulator.target_pictures.textures import target

USUAL_SIDE_M: Final = 1.2
MAX_SIDE_M: Final = 20.0
SQUARES: Final = 4


@dataclass(frozen=True, slots=True)
class GroundTarget:
    """`north_m`, `east_m`: its centre. `heading_deg`: of the letter's top, from north, clockwise. `number`: chooses its
    looks."""

    letter: str
    north_m: float
    east_m: float
    heading_deg: float
    side_m: float
    number: int


def parse_target(text: str) -> tuple[str, float, float, float, float]:
    """Parses `LETTER@LAT,LON[,HEADING[,SIDE]]` in degrees and metres. Raises ValueError."""
    letter, at, rest = text.partition("@")
    try:
        lat_deg, lon_deg, *more = (float(word) for word in rest.split(","))
        heading_deg, side_m = [*more, *(0.0, USUAL_SIDE_M)[len(more) :]]
    except ValueError:
        at = ""
    if not at or not (len(letter) == 1 and "A" <= letter <= "Z"):
        raise ValueError(f"{text!r} is not LETTER@LAT,LON[,HEADING[,SIDE]]")
    if not (abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0 and 0.1 <= side_m <= MAX_SIDE_M):
        raise ValueError(f"{text!r}: there is no such place, or its side is not 0.1 to {MAX_SIDE_M:g} m")
    return letter, lat_deg, lon_deg, heading_deg, side_m


@lru_cache(maxsize=64)
def _plate(letter: str, number: int) -> list[Picture]:
    return levels_of(target(letter, SQUARES, np.random.default_rng([ord(letter), number])).pixels)


def draw_targets(picture: Picture, view: View, targets: list[GroundTarget]) -> None:
    """Draws those that are in sight."""
    for one in targets:
        centre = np.array([one.north_m, one.east_m])
        draw_flat(picture, view, _plate(one.letter, one.number), (centre, *axes(one.heading_deg)), one.side_m)
