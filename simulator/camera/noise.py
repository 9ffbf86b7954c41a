"""Random patterns that tile: the right edge continues at the left, and the bottom at the top."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

Floats32 = npt.NDArray[np.float32]


def smooth(random: np.random.Generator, size_px: int, cells: int) -> Floats32:
    """Returns a square of values from -1 to 1, with `cells` hills and hollows along each edge."""
    margin = 2
    grid = random.uniform(-1.0, 1.0, (cells, cells)).astype(np.float32)
    padded = np.pad(grid, margin, mode="wrap")
    scale = size_px / cells
    move = np.array([[1 / scale, 0.0, margin], [0.0, 1 / scale, margin]])
    return np.asarray(
        cv2.warpAffine(padded, move, (size_px, size_px), flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP), np.float32
    )


def cloudy(random: np.random.Generator, size_px: int, cells: int, octaves: int) -> Floats32:
    """Adds finer and finer detail, each octave half as strong."""
    total = np.zeros((size_px, size_px), np.float32)
    for octave in range(octaves):
        if cells << octave <= size_px:
            total += smooth(random, size_px, cells << octave) * 0.5**octave
    return total / 2.0
