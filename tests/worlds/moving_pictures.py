"""Moving pictures like those from a drone, for encoders: ground that turns and slides by, with a little noise."""

import av
import cv2
import numpy as np

from onboard_agent.video.sources.source import Picture


def ground(width: int, height: int, seed: int = 1) -> np.ndarray:
    """Returns ground with detail of every size, larger than a picture by the distance that the flight covers."""
    random = np.random.default_rng(seed)
    noise = random.normal(128, 60, (height * 2, width * 3)).astype(np.float32)
    texture = sum(cv2.GaussianBlur(noise, (0, 0), size) * size for size in (1, 3, 9, 27))
    low, high = texture.min(), texture.max()
    return ((texture - low) / (high - low) * 219 + 16).astype(np.uint8)


def flight(width: int, height: int, count: int, seed: int = 1) -> list[av.VideoFrame]:
    """Returns `count` pictures, yuv420p, luma from 16 to 235."""
    random = np.random.default_rng(seed)
    below = ground(width, height, seed)
    frames = []
    for number in range(count):
        x, y = width * (1 + 0.8 * np.sin(number / 60)), height * (0.5 + 0.4 * np.sin(number / 47))
        turn = cv2.getRotationMatrix2D((x + width / 2, y + height / 2), 8 * np.sin(number / 30), 1.0)
        turn[:, 2] -= (x, y)
        seen = cv2.warpAffine(below, turn, (width, height), borderMode=cv2.BORDER_REFLECT)
        noisy = seen.astype(np.int16) + random.integers(-3, 4, seen.shape, dtype=np.int16)
        planes = np.full((height * 3 // 2, width), 128, np.uint8)
        planes[:height] = np.clip(noisy, 16, 235)
        frames.append(av.VideoFrame.from_ndarray(planes, format="yuv420p"))
    return frames


def pictures(frames: list[av.VideoFrame], rate_hz: float, begin_us: int = 1_000_000) -> list[Picture]:
    """Returns the frames as a camera delivers them."""
    return [
        Picture(frame, begin_us + round(number * 1e6 / rate_hz), number + 1, number == 0)
        for number, frame in enumerate(frames)
    ]


def luma(frame: av.VideoFrame) -> np.ndarray:
    """Returns the luma of the picture, as coded."""
    return frame.to_ndarray(format="yuv420p")[: frame.height].astype(float)


def off_by(one: av.VideoFrame, other: av.VideoFrame) -> float:
    """Returns the mean difference of the lumas, of 255."""
    return float(np.abs(luma(one) - luma(other)).mean())
