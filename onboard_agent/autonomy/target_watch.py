"""The process that looks for the target (`look`), seen from the controller: what it has seen, placed on the map.

Nothing here waits: a step takes what has come. So the rate of pictures is whatever the computer manages.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
from dataclasses import dataclass
from typing import Final

import msgspec

from onboard_agent.autonomy.cameras import ControllerCameras
from onboard_agent.autonomy.core.lines import MAX_LINE_BYTES, VIDEO, VideoBox
from onboard_agent.autonomy.look import InPicture, Looked, LookSetUp
from onboard_agent.autonomy.pose_history import Pose, PoseHistory
from onboard_agent.vision.camera_model import Attitude, CameraModel, Mounting
from onboard_agent.vision.ground_position import ground_place, moved_deg

COMMAND: Final = (sys.executable, "-m", "onboard_agent.autonomy.look")
_decoder: Final = msgspec.json.Decoder(Looked)


@dataclass(frozen=True, slots=True)
class TargetSeen:
    """The followed target as one picture shows it. `lat_deg`, `lon_deg`: on level ground at the height of home. `pose`:
    of the drone when the picture was taken, at `taken_s` of CLOCK_MONOTONIC. `in_video`: None if the live video shows
    another camera."""

    taken_s: float
    lat_deg: float
    lon_deg: float
    pose: Pose
    target: InPicture
    in_video: VideoBox | None = None


class TargetWatch:
    """Call `start` once, then `pop` as often as wanted. `name`: of the camera. `target`: its kind, as
    `parse_kind` reads it. `alphabet`: the characters that occur."""

    def __init__(self, cameras: ControllerCameras, name: str, target: str, alphabet: str) -> None:
        self.words = ""
        """Why it sees nothing any more."""
        self._cameras = cameras
        self._camera = cameras.settings[name]
        self._target = target
        self._alphabet = alphabet
        self._process: subprocess.Popen[bytes] | None = None
        self._buffer = b""

    def start(self) -> None:
        """Starts the process; it ends with this one."""
        self._process = process = subprocess.Popen(  # noqa: S603 - ourselves
            COMMAND, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0
        )
        assert process.stdin is not None and process.stdout is not None
        set_up = LookSetUp(self._camera, self._target, self._alphabet, self._cameras.frames_path)
        process.stdin.write(msgspec.json.encode(set_up) + b"\n")
        os.set_blocking(process.stdout.fileno(), False)

    def pop(self) -> list[TargetSeen]:
        """Returns what was seen since the last call, oldest first."""
        seen = []
        for line in self._lines():
            looked = _decoder.decode(line)
            self._cameras.taken = looked.pictures
            if looked.target is not None:
                placed = self._placed(looked, looked.target, self._cameras.poses)
                seen += [] if placed is None else [placed]
        return seen

    def _lines(self) -> list[bytes]:
        process = self._process
        if process is None or process.stdout is None:
            return []
        try:
            data = os.read(process.stdout.fileno(), 4 * MAX_LINE_BYTES)
        except BlockingIOError:
            return []
        if not data:
            self.words = f"the process that looks for the target has ended (code {process.wait()})"
            self._process = None
        *lines, self._buffer = (self._buffer + data).split(b"\n")
        return lines

    def _placed(self, looked: Looked, target: InPicture, poses: PoseHistory) -> TargetSeen | None:
        pose, camera = poses.at(looked.taken_s), self._camera
        if pose is None:
            return None
        mounting = Mounting(tilt_deg=camera.tilt_deg, down_m=-camera.up_m)
        model = CameraModel(looked.width_px, looked.height_px, camera.field_of_view_deg, mounting)
        attitude = Attitude(*(math.radians(angle) for angle in (pose.roll_deg, pose.pitch_deg, pose.yaw_deg)))
        place = ground_place(model, target.centre_px, attitude, pose.height_m)
        if place is None:
            return None
        in_video = _in_video(looked, target) if camera.source == VIDEO else None
        return TargetSeen(looked.taken_s, *moved_deg(pose.lat_deg, pose.lon_deg, place), pose, target, in_video)


def _in_video(looked: Looked, target: InPicture) -> VideoBox:
    shares = (
        part / of
        for part, of in zip((*target.centre_px, *target.size_px), (looked.width_px, looked.height_px) * 2, strict=True)
    )
    x, y, width, height = (min(max(share, 0.0), 1.0) for share in shares)
    return VideoBox(x, y, width, height, looked.taken_s)
