"""The clock in the top rows of each picture, by which programs measure the age of a picture.

Twenty cells over the full width: black, white (reference levels for the reader), the 16 bits of the time in Gray code
with the most significant one first, their even parity, and its complement. Gray code, because two adjacent times that a
codec has mixed differ in one cell only.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import numpy.typing as npt

CELLS = 20
WRAPS_MS = 65536
BLACK, WHITE = 16, 235


def strip_height(picture_height: int) -> int:
    """In pixels: a twentieth of the picture, in whole blocks of a codec."""
    return math.ceil(picture_height / CELLS / 8) * 8


def cells_of(unix_ms: int) -> list[bool]:
    """Returns the cells from left to right; True is white."""
    time = unix_ms % WRAPS_MS
    gray = time ^ time >> 1
    bits = [bool(gray >> shift & 1) for shift in range(15, -1, -1)]
    odd = sum(bits) % 2 == 1
    return [False, True, *bits, odd, not odd]


def draw_strip(picture: npt.NDArray[np.uint8], unix_ms: int) -> None:
    """Draws into a picture (height, width[, channels])."""
    height, width = picture.shape[:2]
    edges = [round(cell * width / CELLS) for cell in range(CELLS + 1)]
    rows = picture[: strip_height(height)]
    for white, (left, right) in zip(cells_of(unix_ms), itertools.pairwise(edges), strict=True):
        rows[:, left:right] = WHITE if white else BLACK
