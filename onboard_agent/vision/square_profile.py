"""Looks for further squares around those whose outlines were found: where ground and target touch in the same grey, an
outline breaks, but the mean along each side still steps."""

from __future__ import annotations

from typing import Final

import numpy as np

from onboard_agent.vision.quadrilaterals import Floats, Grey

MAX_SHARE: Final = 1.7
"""Of the outermost square found, as far as is searched."""
MIN_STEP: Final = 14.0
"""Of 255, in the stretched picture, on three of four sides."""
MIN_STEP_SHARE: Final = 0.35
"""Of the strongest step among the squares found: the ground's own shades are fainter."""
_NEAREST_SHARE: Final = 1.09
_NEAREST_PX: Final = 5.0
"""Nearer is the blur of the square's own edge."""
_AROUND: Final = 3
_STEPS: Final = 104
_SAMPLES: Final = 28
_STEP_SHARE: Final = 0.06
_ALONG: Final = np.linspace(-0.8, 0.8, _SAMPLES)
_HALVES: Final = np.linspace(0.4, MAX_SHARE, _STEPS)


def _rays() -> Floats:
    """Points (4, steps, samples, 2) on squares of growing half side around the origin, side by side."""
    along = np.broadcast_to(_ALONG * 1.0, (_STEPS, _SAMPLES)) * _HALVES[:, None]
    across = np.broadcast_to(_HALVES[:, None], (_STEPS, _SAMPLES))
    sides = [(along, -across), (across, along), (along, across), (-across, along)]
    return np.array([np.stack(side, axis=-1) for side in sides])


_POINTS: Final = _rays()


def next_square(grey: Grey, from_unit: Floats, half_px: float) -> float | None:
    """Returns the half side of the next square outside the one from -1 to 1; None if there is none up to `MAX_SHARE`.

    `from_unit`: homography from that plane to pixels. `half_px`: half of the square's mean side."""
    whole = _POINTS @ from_unit[:, :2].T + from_unit[:, 2]
    if (whole[..., 2] <= 1e-6).any():  # a corner of the search lies behind the camera
        return None
    pixels = np.rint(whole[..., :2] / whole[..., 2:]).astype(np.int64)
    x, y = pixels[..., 0], pixels[..., 1]
    inside = (x >= 0) & (x < grey.shape[1]) & (y >= 0) & (y < grey.shape[0])
    seen = grey[y.clip(0, grey.shape[0] - 1), x.clip(0, grey.shape[1] - 1)].astype(np.float64)
    counts = inside.sum(axis=2)
    profile = np.where(inside, seen, 0.0).sum(axis=2) / np.maximum(counts, 1)
    steps = np.abs(profile[:, 4:] - profile[:, :-4])
    steps[(counts < _SAMPLES // 2)[:, 4:]] = 0.0
    third = np.sort(steps, axis=0)[1]
    """The weakest of the three strongest sides."""
    halves = _HALVES[2:-2]
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(third, _AROUND), 2 * _AROUND + 1)
    nearest = max(_NEAREST_SHARE, 1.0 + _NEAREST_PX / half_px)
    least = max(MIN_STEP, MIN_STEP_SHARE * float(third[halves < 1.0 + _STEP_SHARE].max()))
    peaks = np.flatnonzero((third >= windows.max(axis=1)) & (third >= least) & (halves >= nearest))
    return float(halves[peaks[0]]) if len(peaks) else None
