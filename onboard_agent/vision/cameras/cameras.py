"""One interface to all cameras of a vehicle: `Cameras.get_frames`.

The sources are those of live video: `v4l2:/dev/video0` reads a camera through OpenCV, `http://127.0.0.1:8090/camera`
that of `tower-sim --camera`. Each has a thread that keeps the newest picture and reopens a lost camera. A device serves
one program at a time: it is either streamed or looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from onboard_agent.video.sources.camera import Camera
from onboard_agent.video.sources.schemes import make_source
from onboard_agent.video.sources.source import PictureRequest, Source
from wire.video import CameraState


@dataclass(frozen=True, slots=True)
class Frame:
    """`pixels`: (height, width, 3), blue, green, red; yours to modify. `taken_s`: by CLOCK_MONOTONIC. `number` counts a
    camera's pictures from 1; a gap means pictures that nobody fetched. `is_break`: the first after the camera was
    opened (again)."""

    pixels: npt.NDArray[np.uint8]
    taken_s: float
    number: int
    is_break: bool


class Cameras:
    """Call `start`, `get_frames` as often as wanted, then `stop`; or use it as a context manager."""

    def __init__(
        self,
        sources: Mapping[str, Source],
        request: PictureRequest | None = None,
        on_change: Callable[[], None] = lambda: None,
    ) -> None:
        """`sources`: by the name of the camera. `on_change` is called by a camera's thread at each picture and each
        change of state; it must not block."""
        self._cameras = {
            name: Camera(source, request or PictureRequest(), on_change) for name, source in sources.items()
        }

    @classmethod
    def open(
        cls,
        specs: Mapping[str, str],
        request: PictureRequest | None = None,
        on_change: Callable[[], None] = lambda: None,
    ) -> Cameras:
        """Takes settings as `camera` in agent.toml, by the name of the camera. Raises Unusable for one that names no
        camera. Not yet started."""
        return cls({name: make_source(spec) for name, spec in specs.items()}, request, on_change)

    def __enter__(self) -> Cameras:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self) -> None:
        for camera in self._cameras.values():
            camera.start()

    def stop(self) -> bool:
        """False: a thread hangs in a driver, and only the end of the process releases that camera."""
        stopped = [camera.stop() for camera in self._cameras.values()]
        return all(stopped)

    def get_frames(self) -> dict[str, Frame]:
        """Returns the newest picture of each camera that has one since the last call. Does not wait."""
        frames = {}
        for name, camera in self._cameras.items():
            picture = camera.newest()
            if picture is not None:
                pixels = np.asarray(picture.frame.to_ndarray(format="bgr24"), np.uint8)
                frames[name] = Frame(pixels, picture.capture_us / 1e6, picture.number, picture.is_break)
        return frames

    def states(self) -> dict[str, tuple[CameraState, str]]:
        """Returns state and, if there is a problem, words for people."""
        return {name: (camera.state, camera.words) for name, camera in self._cameras.items()}
