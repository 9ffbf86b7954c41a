"""How far calibrations and motor tests are: prompts, progress and delays of ArduCopter 4.6, as measured
(docs/vehicle-setup.md).

Nobody turns a simulated vehicle by hand. So each position of the accelerometer counts as taken when the ground station
says so, and a compass calibration completes by itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Protocol

from simulator.dialect import Message, mavlink
from simulator.failure_modes import Failure
from simulator.notices import Severity

POSES: Final = 6
POSE_TEXTS: Final = (
    "Place vehicle level and press any key.",
    "Place vehicle on its LEFT side and press any key.",
    "Place vehicle on its RIGHT side and press any key.",
    "Place vehicle nose DOWN and press any key.",
    "Place vehicle nose UP and press any key.",
    "Place vehicle on its BACK and press any key.",
)
SUCCESS: Final = float(mavlink.ACCELCAL_VEHICLE_POS_SUCCESS)
FAILURE: Final = float(mavlink.ACCELCAL_VEHICLE_POS_FAILED)
PROMPT_S: Final = 1.1
MEASURE_S: Final = 0.6
COMPASSES: Final = 3
COMPASS_S: Final = 20.0


class Machine(Protocol):
    """What it reads of a vehicle, and where its texts go."""

    now_s: float
    failures: set[Failure]

    def notify(self, severity: Severity, text: str) -> None: ...


@dataclass
class VehicleSetup:
    """Of one vehicle since it booted."""

    texts: list[tuple[float, Severity, str]] = field(default_factory=list)
    """(second, severity, text) to come."""
    answers: list[tuple[float, int, int]] = field(default_factory=list)
    """(second, command, MAV_RESULT): acknowledgements to come."""
    pose: int | None = None
    """The position that the accelerometer's calibration asks for, from 1."""
    accel_outcome: float | None = None
    """Repeated as the prompts are, until a reboot or the next calibration."""
    accel_needed: bool = False
    compass_since_s: float | None = None
    compass_kept: bool = False
    """Needs a reboot before it arms."""
    motor: int | None = None
    motor_until_s: float = 0.0
    _prompt_due_s: float = 0.0
    _measured_at_s: float | None = None
    _reported: int = 0

    @property
    def compass_runs(self) -> bool:
        return self.compass_since_s is not None

    def why_not_ready(self) -> str | None:
        """The check before arming that fails because of it, in ArduPilot's words."""
        if self.compass_runs:
            return "Compass calibration running"
        if self.accel_needed:
            return "3D Accel calibration needed"
        return "Compass calibrated requires reboot" if self.compass_kept else None

    def due(self, flight: Machine) -> list[Message]:
        """Texts go to the flight's notices; returns the messages to send now."""
        now_s = flight.now_s
        for text in self.texts and [one for one in self.texts if one[0] <= now_s]:
            self.texts.remove(text)
            flight.notify(text[1], text[2])
        if self.motor is not None and now_s >= self.motor_until_s:
            self.motor = None
            flight.notify(Severity.INFO, "finished motor test")
        self._measure(flight)
        return self._prompts(now_s)

    def answers_due(self, now_s: float) -> list[tuple[int, int]]:
        """(command, MAV_RESULT) of the acknowledgements to send now."""
        if not self.answers:
            return []
        due = [one for one in self.answers if one[0] <= now_s]
        self.answers = [one for one in self.answers if one[0] > now_s]
        return [(number, result) for _, number, result in due]

    def ask_for_pose(self, pose: int, flight: Machine, after_s: float) -> None:
        self.pose, self.accel_outcome, self._measured_at_s = pose, None, None
        self._prompt_due_s = flight.now_s + after_s
        self.texts.append((self._prompt_due_s, Severity.CRITICAL, POSE_TEXTS[pose - 1]))

    def measure_from(self, now_s: float) -> None:
        self._measured_at_s = now_s + MEASURE_S

    def _measure(self, flight: Machine) -> None:
        if self.pose is None or self._measured_at_s is None or flight.now_s < self._measured_at_s:
            return
        if Failure.CALIBRATION_FAILS in flight.failures and self.pose == 2:
            self._end_accel(flight, FAILURE, "Calibration FAILED")
        elif self.pose == POSES:
            self._end_accel(flight, SUCCESS, "Calibration successful")
        else:
            self.ask_for_pose(self.pose + 1, flight, 0.0)

    def _end_accel(self, flight: Machine, outcome: float, text: str) -> None:
        self.pose, self.accel_outcome, self._measured_at_s = None, outcome, None
        self.accel_needed = outcome == FAILURE
        self._prompt_due_s = flight.now_s
        flight.notify(Severity.CRITICAL, text)

    def _prompts(self, now_s: float) -> list[Message]:
        value = self.accel_outcome if self.pose is None else float(self.pose)
        if value is None or now_s < self._prompt_due_s:
            return []
        self._prompt_due_s = now_s + PROMPT_S
        number = mavlink.MAV_CMD_ACCELCAL_VEHICLE_POS
        return [mavlink.MAVLink_command_long_message(0, 0, number, 0, value, 0, 0, 0, 0, 0, 0)]

    # The compass.

    def percent(self, now_s: float) -> int:
        since = now_s if self.compass_since_s is None else self.compass_since_s
        return min(100, int((now_s - since) / COMPASS_S * 100))

    def progress(self, flight: Machine) -> Message | None:
        """MAG_CAL_PROGRESS of the next compass in turn; None while none is calibrated, or when it is over."""
        percent = self.percent(flight.now_s)
        if not self.compass_runs or percent >= 100:
            return None
        running = mavlink.MAG_CAL_RUNNING_STEP_ONE if percent < 50 else mavlink.MAG_CAL_RUNNING_STEP_TWO
        mask = [255 if at * 10 < percent else 0 for at in range(10)]
        return mavlink.MAVLink_mag_cal_progress_message(
            self._next_compass(), (1 << COMPASSES) - 1, running, 1, percent, mask, 0.0, 0.0, 0.0
        )

    def report(self, flight: Machine) -> Message | None:
        """MAG_CAL_REPORT of the next compass in turn, until it is kept or cancelled."""
        if not self.compass_runs or self.percent(flight.now_s) < 100:
            return None
        fails = Failure.CALIBRATION_FAILS in flight.failures
        status, fitness = (mavlink.MAG_CAL_FAILED, 61.0) if fails else (mavlink.MAG_CAL_SUCCESS, 4.2)
        offsets = (5.0, 13.0, -18.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
        return mavlink.MAVLink_mag_cal_report_message(
            self._next_compass(), (1 << COMPASSES) - 1, status, 0, fitness, *offsets
        )

    def _next_compass(self) -> int:
        self._reported += 1
        return self._reported % COMPASSES
