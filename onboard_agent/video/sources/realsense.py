"""One stream of a RealSense camera: colour, infrared or depth. Depth comes in millimetres (`depth`), whatever the
device counts. Streams of one device in one process share it (`realsense_device`)."""

from __future__ import annotations

import time
from typing import Any, Final

import av
import numpy as np

from onboard_agent.video.sources.arrival_clock import ArrivalClock
from onboard_agent.video.sources.depth import to_millimetres
from onboard_agent.video.sources.mode import Mode
from onboard_agent.video.sources.picture_size import TooLarge, check_size
from onboard_agent.video.sources.realsense_device import Failed, RealsenseDevice, Seat, shared_device
from onboard_agent.video.sources.realsense_pipeline import RealsensePipeline, library
from onboard_agent.video.sources.realsense_streams import Stream, Where
from onboard_agent.video.sources.source import CameraLost, PictureRequest, Source, Taken, now_us

_READ_S: Final = 0.2
_OLDEST_US: Final = 1_000_000
"""A stamp that is older, or in the future, is of another clock."""
_PIXELS: Final = {
    "rgb8": "rgb24",
    "bgr8": "bgr24",
    "rgba8": "rgba",
    "bgra8": "bgra",
    "y8": "gray",
    "y16": "gray16le",
    "z16": "gray16le",
}


class RealsenseSource(Source):
    """`device`: for tests; None: the one of this process."""

    lets_go_within_s = 3.0  # the library stops the streams first

    def __init__(
        self, name: str, stream: Stream, where: Where, mode: Mode, device: RealsenseDevice | None = None
    ) -> None:
        super().__init__(name)
        self._device = device or shared_device(where, lambda modes: RealsensePipeline(where, modes))
        self._seat = Seat(stream, mode)
        self._ticket: object | None = None
        self._clock = ArrivalClock()

    def open(self, request: PictureRequest) -> None:
        try:
            library()
            self._ticket = self._device.join(self._seat)
        except Failed as error:
            raise CameraLost(f"{self.name}: {error}") from None
        self._clock = ArrivalClock()

    def read(self) -> Taken | None:
        assert self._ticket is not None
        try:
            frame = self._device.take(self._ticket, _READ_S)
            if frame is None:
                return None
            arrived_us = now_us()
            frame = frame.as_video_frame()
            check_size(frame.get_width(), frame.get_height())
            return Taken(self._picture(frame), self._taken_us(frame, arrived_us))
        except (Failed, TooLarge) as error:
            raise CameraLost(f"{self.name}: {error}") from None

    def close(self) -> None:
        if self._ticket is not None:
            self._device.leave(self._ticket)
            self._ticket = None

    def _picture(self, frame: Any) -> av.VideoFrame:
        """Copies the pixels: the library has few frames, and wants them back."""
        kind = frame.get_profile().format().name
        pixels = np.asanyarray(frame.get_data())
        if kind == "z16":
            pixels = to_millimetres(pixels, frame.as_depth_frame().get_units())
        elif kind in ("yuyv", "uyvy"):
            pixels = pixels.view(np.uint8).reshape(pixels.shape[0], -1, 2)
            return av.VideoFrame.from_ndarray(
                np.ascontiguousarray(pixels if kind == "yuyv" else pixels[:, :, ::-1]), format="yuyv422"
            )
        if kind not in _PIXELS:
            raise Failed(f"gives {kind}, which we cannot read")
        return av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), format=_PIXELS[kind])

    def _taken_us(self, frame: Any, arrived_us: int) -> int:
        """The library's stamps are of this computer's wall clock where it knows the camera's clock, else of the
        camera's; those of a recording are of a past day."""
        stamp_us = int(frame.get_timestamp() * 1000)
        if frame.get_frame_timestamp_domain().name != "hardware_clock":
            taken_us = arrived_us - (time.time_ns() // 1000 - stamp_us)
            if 0 <= arrived_us - taken_us <= _OLDEST_US:
                return taken_us
        return self._clock.taken_us(stamp_us, arrived_us)
