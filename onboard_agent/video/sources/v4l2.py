"""A Linux camera (V4L2) through OpenCV, which handles the ioctls. Pictures stay in the camera's format: converting them
to OpenCV's BGR and back would cost more than encoding them.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, Protocol

import av
import cv2
import numpy as np

from onboard_agent.video.sources.decoding import JpegDecoder
from onboard_agent.video.sources.mode import Mode
from onboard_agent.video.sources.picture_size import TooLarge, check_size
from onboard_agent.video.sources.source import CameraLost, PictureRequest, Source, Taken, now_us

_OLDEST_STAMP_US: Final = 1_000_000
"""A driver timestamp that is older, or in the future, belongs to another clock."""

_PLANAR_420: Final = {"YU12": "yuv420p", "I420": "yuv420p", "NV12": "nv12"}


class Capture(Protocol):
    """The required part of cv2.VideoCapture."""

    def isOpened(self) -> bool: ...
    def set(self, what: int, value: float) -> bool: ...
    def get(self, what: int) -> float: ...
    def grab(self) -> bool: ...
    def retrieve(self) -> tuple[bool, Any]: ...
    def release(self) -> None: ...


def _open_device(device: str) -> Capture:
    return cv2.VideoCapture(device, cv2.CAP_V4L2)


class V4l2Source(Source):
    """The driver buffers one picture at most, so that none waits."""

    def __init__(
        self, name: str, device: str, mode: Mode, open_device: Callable[[str], Capture] = _open_device
    ) -> None:
        super().__init__(name)
        self._device = device
        self._mode = mode
        self._open_device = open_device
        self._capture: Capture | None = None
        self._decoder = JpegDecoder()
        self._fourcc = ""

    def open(self, request: PictureRequest) -> None:
        if not Path(self._device).exists():
            raise CameraLost(f"{self.name}: there is no {self._device}")
        if not os.access(self._device, os.R_OK | os.W_OK):
            raise CameraLost(f"{self.name}: {self._device} may not be used by this user (is it in the group video?)")
        capture = self._open_device(self._device)
        self._capture = capture
        if not capture.isOpened():
            raise CameraLost(f"{self.name}: {self._device} is no camera, or another program has it")
        capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        # Compressed, because USB 2 cannot carry 640 x 480 at 30 Hz beside other traffic. FOURCC below has the result.
        capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))
        capture.set(cv2.CAP_PROP_FRAME_WIDTH, self._mode.width or request.width)
        capture.set(cv2.CAP_PROP_FRAME_HEIGHT, self._mode.height or request.height)
        capture.set(cv2.CAP_PROP_FPS, self._mode.rate_hz or request.rate_hz)
        capture.set(cv2.CAP_PROP_CONVERT_RGB, 0)
        try:  # check the size that the driver chose, before the first picture is fetched
            check_size(int(capture.get(cv2.CAP_PROP_FRAME_WIDTH)), int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)))
        except TooLarge as error:
            raise CameraLost(f"{self.name}: {error}") from None
        self._fourcc = _fourcc_name(int(capture.get(cv2.CAP_PROP_FOURCC)))
        self._decoder = JpegDecoder()

    def read(self) -> Taken | None:
        capture = self._capture
        if capture is None or not capture.grab():
            raise CameraLost(f"{self.name}: {self._device} gives no pictures any more")
        here_us = now_us()
        whole, pixels = capture.retrieve()
        if not whole or pixels is None:
            return None
        try:
            frame = self._frame(np.asarray(pixels, dtype=np.uint8))
            if frame is not None:
                check_size(frame.width, frame.height)
        except TooLarge as error:
            raise CameraLost(f"{self.name}: {error}") from None
        return None if frame is None else Taken(frame, self._taken_us(capture, here_us))

    def close(self) -> None:
        if self._capture is not None:
            self._capture.release()
            self._capture = None

    def _taken_us(self, capture: Capture, here_us: int) -> int:
        """The driver's timestamp is of CLOCK_MONOTONIC on nearly all systems, taken when the sensor was read."""
        stamp_us = round(capture.get(cv2.CAP_PROP_POS_MSEC) * 1000)
        return stamp_us if 0 <= here_us - stamp_us <= _OLDEST_STAMP_US else here_us

    def _frame(self, pixels: np.ndarray[Any, np.dtype[np.uint8]]) -> av.VideoFrame | None:
        """Converts by the shape of OpenCV's data: a row of bytes is a JPEG, others are pixels. None: a damaged JPEG."""
        if pixels.ndim == 1 or pixels.shape[0] == 1:
            return self._decoder.decode(pixels.tobytes())
        if pixels.ndim == 3 and pixels.shape[2] == 3:
            return av.VideoFrame.from_ndarray(pixels, format="bgr24")
        if pixels.ndim == 3 and pixels.shape[2] == 2 and self._fourcc in ("YUYV", "YUY2"):
            return av.VideoFrame.from_ndarray(pixels, format="yuyv422")
        if pixels.ndim == 3 and pixels.shape[2] == 2 and self._fourcc == "UYVY":
            return av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels[:, :, ::-1]), format="yuyv422")
        if pixels.ndim == 2 and self._fourcc in _PLANAR_420:
            return av.VideoFrame.from_ndarray(pixels, format=_PLANAR_420[self._fourcc])
        if pixels.ndim == 2 and self._fourcc == "GREY":
            return av.VideoFrame.from_ndarray(pixels, format="gray")
        raise CameraLost(f"{self.name}: gives {self._fourcc or 'pixels of an unknown kind'}, which we cannot read")


def _fourcc_name(code: int) -> str:
    return code.to_bytes(4, "little").decode("latin-1").strip("\x00 ") if 0 < code < 1 << 32 else ""
