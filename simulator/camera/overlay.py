"""The text that a camera writes into its pictures: whose they are, and the clock for people to read."""

from __future__ import annotations

from datetime import UTC, datetime

import cv2
import numpy as np
import numpy.typing as npt

Picture = npt.NDArray[np.uint8]

FONT = cv2.FONT_HERSHEY_SIMPLEX
SCALE_PER_PX = 0.55 / 640
DARK, LIGHT = (16, 16, 16), (235, 235, 235)


def clock_text(unix_us: int) -> str:
    """`2026-03-01 12:00:00.123 UTC`."""
    moment = datetime.fromtimestamp(unix_us // 1000 / 1000, UTC)
    return f"{moment:%Y-%m-%d %H:%M:%S}.{unix_us // 1000 % 1000:03d} UTC"


def draw_texts(picture: Picture, name: str, unix_us: int) -> None:
    """Name at the bottom left, clock at the bottom right, light with a dark edge."""
    height, width = picture.shape[:2]
    scale = width * SCALE_PER_PX
    edge = max(round(width / 16 / 16), 2)
    margin = round(width / 64)
    clock = clock_text(unix_us)
    (clock_px, _), _ = cv2.getTextSize(clock, FONT, scale, 1)
    for text, left in ((name, margin), (clock, width - margin - clock_px)):
        at = (left, height - margin)
        cv2.putText(picture, text, at, FONT, scale, DARK, edge, cv2.LINE_AA)
        cv2.putText(picture, text, at, FONT, scale, LIGHT, 1, cv2.LINE_AA)
