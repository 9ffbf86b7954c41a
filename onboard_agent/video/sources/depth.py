"""Depth pictures: 16 bits a pixel, in millimetres, 0 where the distance is not known. The same from every camera."""

from typing import Final

import numpy as np
import numpy.typing as npt

UNIT_M: Final = 0.001
_MOST: Final = 0xFFFF


def to_millimetres(counts: npt.NDArray[np.uint16], count_m: float) -> npt.NDArray[np.uint16]:
    """`counts`: as the camera counts, `count_m` metres each. A distance of more than 65.535 m becomes unknown (0); a
    known one does not become 0."""
    if abs(count_m - UNIT_M) < 1e-9:
        return counts
    millimetres = np.rint(counts * np.float32(count_m / UNIT_M))
    millimetres[(millimetres == 0) & (counts > 0)] = 1
    millimetres[millimetres > _MOST] = 0
    return np.asarray(millimetres, np.uint16)


def metres(pixels: npt.NDArray[np.generic]) -> npt.NDArray[np.float32]:
    """Returns the distances along the camera's axis of a frame of kind `depth`; NaN where it is not known."""
    found = pixels.astype(np.float32) * np.float32(UNIT_M)
    found[pixels == 0] = np.nan
    return found
