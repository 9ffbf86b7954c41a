"""Landing targets on the ground, for target finding in flight: concentric squares with a letter, or a white square with
a coloured one of half its side and one to three characters in that.

The plates lie flat, and each looks the same in every picture of a seed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import cv2
import numpy as np

from simulator.camera.flat_pictures import Picture, axes, draw_flat, levels_of
from simulator.camera.view import View
from simulator.target_pictures.textures import TEXTURE_PX, target

USUAL_SIDE_M: Final = 1.2
USUAL_PAINTED_M: Final = 2.0
MAX_TEXT: Final = 3
MAX_SIDE_M: Final = 20.0
SQUARES: Final = 4
CHARACTERS: Final = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
PAINTS: Final = {
    "red": (40, 30, 190),
    "blue": (165, 75, 30),
    "green": (60, 120, 30),
    "yellow": (30, 205, 235),
    "purple": (140, 45, 100),
    "black": (28, 26, 26),
}
"""Blue, green, red."""
FORM: Final = "LETTER@LAT,LON[,HEADING[,SIDE]] or TEXT:COLOUR@LAT,LON[,HEADING[,SIDE]]"


@dataclass(frozen=True, slots=True)
class GroundTarget:
    """`north_m`, `east_m`: its centre. `heading_deg`: of the letter's top, from north, clockwise. `number`: chooses its
    looks. `colour`: of `PAINTS`, in a white square; empty: concentric squares, black and white."""

    letter: str
    north_m: float
    east_m: float
    heading_deg: float
    side_m: float
    number: int
    colour: str = ""


def parse_target(text: str) -> tuple[str, float, float, float, float, str]:
    """Parses `FORM` in degrees and metres; the colour comes last. Raises ValueError."""
    name, at, rest = text.partition("@")
    letter, coloured, colour = name.partition(":")
    known = colour in PAINTS if coloured else len(letter) == 1 and "A" <= letter <= "Z"
    try:
        lat_deg, lon_deg, *more = (float(word) for word in rest.split(","))
        heading_deg, side_m = [*more, *(0.0, USUAL_PAINTED_M if coloured else USUAL_SIDE_M)[len(more) :]]
    except ValueError:
        at = ""
    if not at or not known or not 1 <= len(letter) <= MAX_TEXT or not set(letter) <= set(CHARACTERS):
        raise ValueError(f"{text!r} is not {FORM}")
    if not (abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0 and 0.1 <= side_m <= MAX_SIDE_M):
        raise ValueError(f"{text!r}: there is no such place, or its side is not 0.1 to {MAX_SIDE_M:g} m")
    return letter, lat_deg, lon_deg, heading_deg, side_m, colour


@lru_cache(maxsize=64)
def _plate(letter: str, number: int, colour: str) -> list[Picture]:
    if not colour:
        return levels_of(target(letter, SQUARES, np.random.default_rng([ord(letter), number])).pixels)
    board = np.full((TEXTURE_PX, TEXTURE_PX, 3), 242, np.uint8)
    edge = TEXTURE_PX // 4
    board[edge:-edge, edge:-edge] = PAINTS[colour]
    canvas = np.zeros((256, 640), np.uint8)
    cv2.putText(canvas, letter, (40, 200), cv2.FONT_HERSHEY_DUPLEX, 6.0, 255, 20, cv2.LINE_AA)
    left, top, wide, high = cv2.boundingRect((canvas > 127).astype(np.uint8))
    factor = 0.7 * TEXTURE_PX / 2 / max(wide, high)
    size = (round(wide * factor), round(high * factor))
    glyph = cv2.resize(canvas[top : top + high, left : left + wide], size, interpolation=cv2.INTER_AREA)
    x, y = (TEXTURE_PX - size[0]) // 2, (TEXTURE_PX - size[1]) // 2
    under = board[y : y + size[1], x : x + size[0]]
    share = glyph[:, :, None].astype(np.float32) / 255
    ink = 20 if colour == "yellow" else 240
    under[:] = np.round(under * (1 - share) + ink * share).astype(np.uint8)
    return levels_of(board)


def draw_targets(picture: Picture, view: View, targets: list[GroundTarget]) -> None:
    """Draws those that are in sight."""
    for one in targets:
        centre = np.array([one.north_m, one.east_m])
        draw_flat(
            picture, view, _plate(one.letter, one.number, one.colour), (centre, *axes(one.heading_deg)), one.side_m
        )
