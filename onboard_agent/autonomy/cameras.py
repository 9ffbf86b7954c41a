"""The cameras of a controller: the newest picture of each, with the pose of the drone when it was taken.

Colour, infrared and depth come by one interface, from sources of their own or from the video process, which shares its
pictures. They open at the first use: a controller without eyes loads no picture library.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from onboard_agent.autonomy.core.lines import VIDEO, CameraKind, CameraSetting
from onboard_agent.autonomy.pose_history import Pose, PoseHistory

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from onboard_agent.video.sources.camera import Camera

_FORMATS: Final = {CameraKind.COLOUR: "bgr24", CameraKind.INFRARED: "gray", CameraKind.DEPTH: "gray16le"}


@dataclass(frozen=True, slots=True)
class Frame:
    """`pixels`: colour (height, width, 3) of uint8 in the order blue, green, red; infrared (height, width) of uint8;
    depth (height, width) of uint16, as the camera counts. They are yours. `taken_s`: by CLOCK_MONOTONIC, the clock of
    `Seen.at_s`. `number` counts a camera's pictures from 1; a gap means pictures that nobody fetched."""

    camera: CameraSetting
    pixels: npt.NDArray[np.generic]
    taken_s: float
    number: int
    poses: PoseHistory

    @property
    def pose(self) -> Pose | None:
        """Where the drone was when the picture was taken, as well as is known by now; None: not known."""
        return self.poses.at(self.taken_s)


class ControllerCameras:
    """`get_frames` may be called by any one thread. `taken`: how many frames it has returned."""

    def __init__(
        self, settings: Sequence[CameraSetting], poses: PoseHistory | None = None, *, frames_path: str = ""
    ) -> None:
        """`frames_path`: the pictures that the video process shares; empty: it shares none."""
        self.settings = {one.name: one for one in settings}
        self.taken = 0
        self.poses = poses or PoseHistory()
        self.frames_path = frames_path
        self._came = threading.Event()
        self._sources: dict[str, Camera | Any] | None = None

    def get_frames(self, wait_s: float = 0.0) -> dict[str, Frame]:
        """Returns the newest picture of each camera that has one since the last call: never a queue. Waits for the
        first one at most `wait_s`; in a `step` leave it at 0."""
        if self._sources is None:
            self._sources = self._opened()
        if wait_s:
            self._came.wait(wait_s)
        self._came.clear()
        frames = {}
        for name, source in self._sources.items():
            picture = source.newest()
            if picture is not None:
                setting = self.settings[name]
                pixels = picture.frame.to_ndarray(format=_FORMATS[setting.kind])
                frames[name] = Frame(setting, pixels, picture.capture_us / 1e6, picture.number, self.poses)
        self.taken += len(frames)
        return frames

    def problems(self) -> dict[str, str]:
        """Returns words for people on each camera that gives no pictures."""
        return {name: source.words for name, source in (self._sources or {}).items() if source.words}

    def _opened(self) -> dict[str, Any]:
        from onboard_agent.video.sources.camera import Camera
        from onboard_agent.video.sources.schemes import make_source
        from onboard_agent.video.sources.source import PictureRequest

        sources: dict[str, Any] = {}
        for name, setting in self.settings.items():
            if setting.source == VIDEO:
                from onboard_agent.autonomy.shared_camera import SharedCamera

                sources[name] = SharedCamera(self.frames_path, self._came.set)
            else:
                sources[name] = Camera(make_source(setting.source), PictureRequest(), self._came.set)
            sources[name].start()
        return sources
