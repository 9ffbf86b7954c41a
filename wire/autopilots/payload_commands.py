"""A pilot's commands for what the drone carries, as plain values. None of them changes how it flies. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from wire.autopilots.pilot_command import PilotCommand

MIN_PULSE_US: Final = 500
MAX_PULSE_US: Final = 2500
"""No usual servo takes more; ArduPilot itself sends any pulse."""
MAX_SERVO: Final = 255
"""ArduPilot reads the number as one byte: 257 would move servo 1."""
MAX_GRIPPER: Final = 8


@dataclass(frozen=True)
class SetServo(PilotCommand):
    """`servo`: from 1. ArduPilot: the output (SERVOn); PX4: the actuator of its set, 1 to 6. A number that the
    companion computer has set up for a pin of its own moves that pin. `pulse_us`: microseconds."""

    name = "servo"
    servo: int
    pulse_us: int


@dataclass(frozen=True)
class MoveGripper(PilotCommand):
    """Releases the load or grabs it. `gripper`: from 1."""

    name = "gripper"
    grab: bool
    gripper: int = 1


CAMERA: Final = 100
"""MAV_COMP_ID_CAMERA. MAVLink has six, 100 to 105."""
MAX_CAMERAS: Final = 6
AUTOPILOT: Final = 1
"""A camera that the autopilot itself drives."""


@dataclass(frozen=True)
class PointGimbal(PilotCommand):
    """`pitch_deg`: -90 looks straight down. `yaw_deg`: clockwise, from the nose, or with `locked` from north."""

    name = "gimbal"
    pitch_deg: float
    yaw_deg: float = 0.0
    locked: bool = False


@dataclass(frozen=True)
class CameraCommand(PilotCommand):
    """`component`: of the camera, CAMERA and the following, or AUTOPILOT."""

    component: int = CAMERA


@dataclass(frozen=True)
class ZoomCamera(CameraCommand):
    """To a share of the range, or on and on: `direction` 1 in, -1 out, 0 stops."""

    name = "zoom"
    percent: float | None = None
    direction: int = 0


@dataclass(frozen=True)
class TakePhotos(CameraCommand):
    """`count` photographs, 0: until stopped, `every_s` apart. `stop`: no more."""

    name = "photo"
    count: int = 1
    every_s: float = 0.0
    stop: bool = False


@dataclass(frozen=True)
class RecordVideo(CameraCommand):
    """Video on the camera's own storage; the live video of the tower is another thing."""

    name = "record"
    on: bool = True
