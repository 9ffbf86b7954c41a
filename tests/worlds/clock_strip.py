"""Reads the clock strip in the top rows of the simulator's pictures (docs/simulator.md) to tell the age of a picture.

Written from the description, not from the code that draws the strip.
"""

from typing import Any, Final

import numpy as np
import numpy.typing as npt

WRAPS_MS: Final = 65536
CELLS: Final = 20
MIN_CONTRAST: Final = 60.0
"""Minimum difference between a white and a black cell, of 255. Below it there is no strip."""
CLEAR: Final = 0.15
"""Minimum distance of a cell from the mid-point between black and white, as a fraction of their difference."""


def read_clock(luma: npt.NDArray[Any]) -> int | None:
    """Returns the Unix time in milliseconds modulo 65536 from the luma (height, width) of a picture of any size.
    Returns None if there is no strip, a cell is neither black nor white, or the parity is wrong."""
    height, width = luma.shape
    strip = height / CELLS
    rows = luma[round(strip * 0.25) : max(round(strip * 0.75), round(strip * 0.25) + 1)].astype(np.float64)
    levels = []
    for cell in range(CELLS):
        left, right = (cell + 0.3) * width / CELLS, (cell + 0.7) * width / CELLS
        levels.append(rows[:, round(left) : max(round(right), round(left) + 1)].mean())
    black, white = levels[0], levels[1]
    if white - black < MIN_CONTRAST:
        return None
    where = [(level - black) / (white - black) for level in levels[2:]]
    if any(abs(part - 0.5) < CLEAR for part in where):
        return None
    bits = [bool(part > 0.5) for part in where]
    time_bits, parity, complement = bits[:16], bits[16], bits[17]
    if parity == complement or sum(time_bits) % 2 != parity:
        return None
    value, bit = 0, False
    for gray in time_bits:
        bit ^= gray
        value = value << 1 | bit
    return value


def age_ms(read: int, unix_ms: int) -> int:
    """Returns the age of the reading `read` at `unix_ms`: -1000 to 64535. Slightly negative if two clocks differ."""
    return (unix_ms - read + 1000) % WRAPS_MS - 1000
