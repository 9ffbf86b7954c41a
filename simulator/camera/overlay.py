"""The text in a camera's pictures: the vehicle's name, and the clock for people."""

from __future__ import annotations

import threading
from datetime import UTC, datetime
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

Picture = npt.NDArray[np.uint8]

FONT = cv2.FONT_HERSHEY_SIMPLEX
WITH_DATE_FROM_PX = 480
"""A narrower picture has room for the time only."""
MIN_SCALE, SCALE_PER_PX = 0.34, 0.5 / 640
LIGHT = 235

_one_at_a_time = threading.Lock()
"""OpenCV does not document its text drawing as thread-safe."""


def clock_text(unix_us: int, *, with_date: bool) -> str:
    """`2026-03-01 12:00:00.123 UTC`."""
    moment = datetime.fromtimestamp(unix_us // 1_000_000, UTC)
    date = f"{moment:%Y-%m-%d} " if with_date else ""
    return f"{date}{moment:%H:%M:%S}.{unix_us // 1000 % 1000:03d} UTC"


@lru_cache(maxsize=512)
def _letter(letter: str, scale: float) -> Picture:
    """White on black. All digits are as wide as a 0, so that the clock does not jitter."""
    with _one_at_a_time:
        (wide, _), _ = cv2.getTextSize("0" if letter.isdigit() else letter, FONT, scale, 1)
        (_, high), below = cv2.getTextSize("Ag0", FONT, scale, 1)
        drawn = np.zeros((high + below + 2, max(wide, round(scale * 8)) + 1, 1), np.uint8)
        cv2.putText(drawn, letter, (0, high + 1), FONT, scale, (LIGHT,), 1, cv2.LINE_AA)
    return drawn


def draw_texts(picture: Picture, name: str, unix_us: int) -> None:
    """Draws the name at the bottom left, the clock at the bottom right, light on a darkened background."""
    height, width = picture.shape[:2]
    scale = max(width * SCALE_PER_PX, MIN_SCALE)
    margin = round(width / 80)
    clock = _line(clock_text(unix_us, with_date=width >= WITH_DATE_FROM_PX), scale)
    _put(picture, clock, width - margin - clock.shape[1], height - margin)
    if name:
        _put(picture, _line(name, scale), margin, height - margin)


def _line(text: str, scale: float) -> Picture:
    return np.concatenate([_letter(letter, scale) for letter in text], axis=1)


def _put(picture: Picture, text: Picture, left: int, bottom: int) -> None:
    """Draws as much of the text as the picture has room for."""
    place = picture[max(bottom - text.shape[0], 0) : bottom, max(left, 0) : max(left, 0) + text.shape[1]]
    place //= 2
    np.maximum(place, text[-place.shape[0] :, : place.shape[1]], out=place)
