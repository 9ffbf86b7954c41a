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
