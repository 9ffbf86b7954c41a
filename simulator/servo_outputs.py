"""The outputs of the autopilot besides the motors: pulses of servos, and a gripper on one of them. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field

OUTPUTS = 16
MOTORS = 4
"""Outputs 1 to 4."""
GRIPPER_GRAB_US, GRIPPER_RELEASE_US = 1900, 1100
"""ArduPilot's GRIP_GRAB and GRIP_RELEASE, as they come."""
GRIPPER_MOVES_S = 0.5


@dataclass(slots=True)
class ServoOutputs:
    """`pulses`: of output 1 to 16, microseconds; 0: no pulse."""

    pulses: list[int] = field(default_factory=lambda: [0] * OUTPUTS)
    grips: bool | None = None
    """What the gripper does or has done: grab (True) or release; None: neither yet."""
    _there_at_s: float | None = None

    def set(self, output: int, pulse_us: int) -> None:
        """`output`: from 1."""
        self.pulses[output - 1] = pulse_us

    def grip(self, grab: bool, now_s: float, *, output: int | None) -> str:
        """Starts the gripper, on an output if it has one. Returns what ArduCopter says about it."""
        done = "grabbed" if grab else "released"
        if self.grips is grab:
            return "" if self._there_at_s is not None else f"Gripper load {done}"
        self.grips = grab
        self._there_at_s = now_s + GRIPPER_MOVES_S if output is not None else None
        if output is not None:
            self.set(output, GRIPPER_GRAB_US if grab else GRIPPER_RELEASE_US)
        return f"Gripper load {'grabbing' if grab else 'releasing'}"

    def due(self, now_s: float) -> str:
        """Returns the text for a gripper that has arrived; once, else empty."""
        if self._there_at_s is None or now_s < self._there_at_s:
            return ""
        self._there_at_s = None
        return f"Gripper load {'grabbed' if self.grips else 'released'}"
