"""The fields of MAVLink's LANDING_TARGET (149) for what a detector saw. Pure.

ArduPilot and PX4 take x, y, z in body axes when `position_valid` is set. ArduPilot otherwise takes the angles of a
camera that looks straight down: its line of sight is (-tan angle_y, tan angle_x, 1) in body axes. The angles here are
of that virtual camera, whatever the mounting, so both readings agree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from onboard_agent.vision.camera_model import Vector

FRAME_BODY_FRD: Final = 12
"""MAV_FRAME_BODY_FRD."""
VISION_FIDUCIAL: Final = 2
"""LANDING_TARGET_TYPE_VISION_FIDUCIAL: a marker."""
VISION_OTHER: Final = 3
"""LANDING_TARGET_TYPE_VISION_OTHER: concentric squares."""


@dataclass(frozen=True, slots=True)
class LandingTarget:
    """Named as in the message; `asdict` gives the arguments of its constructor. Angles and sizes in radians, `distance`
    and place in metres; `distance` is 0 if unknown, and then `position_valid` is 0. `q` (w, x, y, z) rotates body axes
    to the target's; all zeros: unknown, which ArduPilot reads as no heading."""

    time_usec: int
    target_num: int
    frame: int
    angle_x: float
    angle_y: float
    distance: float
    size_x: float
    size_y: float
    x: float
    y: float
    z: float
    q: tuple[float, float, float, float]
    type: int
    position_valid: int


class NotBelow(ValueError):
    """The target is not in the half of the world below the vehicle, so the message's angles cannot say where."""


def landing_target(
    direction: Vector,
    *,
    time_us: int,
    kind: int,
    number: int = 0,
    distance_m: float | None = None,
    size_rad: float = 0.0,
    yaw_rad: float | None = None,
) -> LandingTarget:
    """`direction`: towards the target in body axes (forward, right, down), of any length. `distance_m`: None if
    unknown. `number`: 0 to 255. `yaw_rad`: of the target against the nose, clockwise; None if unknown. Raises NotBelow,
    and ValueError for a distance that is not above 0 or a number outside its range."""
    forward, right, down = direction
    length = math.hypot(forward, right, down)
    if not down > 0.0:
        raise NotBelow("the target is not below the vehicle")
    if not 0 <= number <= 255:
        raise ValueError("number is to be from 0 to 255")
    if distance_m is not None and not distance_m > 0.0:
        raise ValueError("distance_m is to be above 0")
    scale = 0.0 if distance_m is None else distance_m / length
    half = 0.0 if yaw_rad is None else yaw_rad / 2.0
    return LandingTarget(
        time_usec=time_us,
        target_num=number,
        frame=FRAME_BODY_FRD,
        angle_x=math.atan2(right, down),
        angle_y=math.atan2(-forward, down),
        distance=0.0 if distance_m is None else distance_m,
        size_x=size_rad,
        size_y=size_rad,
        x=forward * scale,
        y=right * scale,
        z=down * scale,
        q=(0.0, 0.0, 0.0, 0.0) if yaw_rad is None else (math.cos(half), 0.0, 0.0, math.sin(half)),
        type=kind,
        position_valid=int(distance_m is not None),
    )
