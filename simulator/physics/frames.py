"""Where the motors of each frame are, in ArduPilot's numbering, and which way they turn."""

from __future__ import annotations

import math
from enum import StrEnum

import numpy as np

from simulator.physics.rotation import Floats


class Frame(StrEnum):
    X = "x"
    PLUS = "plus"
    H = "h"


_ANGLES_DEG = {
    Frame.X: (45.0, -135.0, -45.0, 135.0),
    Frame.PLUS: (90.0, -90.0, 0.0, 180.0),
}
"""Of motors 1 to 4, clockwise from the nose."""
H_LENGTH_TO_WIDTH = 1.25
"""The booms of an H are farther apart along the nose than across."""


def motors_of(frame: Frame, arm_m: float) -> Floats:
    """Returns forward, right (metres) and the sign of the reaction torque about down, (3, 4).

    A propeller that turns counter-clockwise, seen from above, turns its vehicle clockwise: +1. In an H they turn the
    other way, because thrust differences twist its cross beam and tilt the motors, which then helps the yaw.
    """
    turns = np.array([1.0, 1.0, -1.0, -1.0])
    if frame is Frame.H:
        half_width = arm_m / math.hypot(1.0, H_LENGTH_TO_WIDTH)
        half_length = half_width * H_LENGTH_TO_WIDTH
        return np.array(
            [
                [half_length, -half_length, half_length, -half_length],
                [half_width, -half_width, -half_width, half_width],
                -turns,
            ]
        )
    angles = np.radians(_ANGLES_DEG[frame])
    return np.array([arm_m * np.cos(angles), arm_m * np.sin(angles), turns])
