"""What the commander knows of its parts: flags, the limits that set them, and the faults that follow from them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from typing import Final

MAX_LEAN_ERROR_RAD = math.radians(35.0)
MOTOR_FAILED_S = 0.3
"""A vehicle that leans so wrongly for so long has lost a motor."""
LOW_V = 3.4 * 4
FLAT_V = 3.0 * 4
VOLTAGE_S = 1.0
"""Time constant of the voltage that is judged."""
BLOWN_M = 2.0
BLOWN_S = 0.5
"""A vehicle so far from its place for so long is blown away."""
FAR_M = 25.0
"""A vehicle so far from its place for so long lands."""


class Sensor(StrEnum):
    ACCELEROMETER = "Accelerometer"
    GYROSCOPE = "Gyroscope"
    COMPASS = "Compass"
    BAROMETER = "Barometer"
    GPS = "GPS"
    BATTERY = "Battery monitor"


class Weight(IntEnum):
    """Of a fault in flight."""

    MINOR = 1
    MAJOR = 2


@dataclass(frozen=True, slots=True)
class Fault:
    """`text` is what STATUSTEXT says."""

    text: str
    weight: Weight = Weight.MINOR


@dataclass(slots=True)
class Health:
    """Flags of one vehicle. They begin as those of a healthy one that has not started."""

    present: frozenset[Sensor] = frozenset(Sensor)
    calibrated: frozenset[Sensor] = frozenset(Sensor)
    radio: bool = True
    radio_required: bool = True
    """False: there is no receiver on board, and sticks come from a ground station."""
    mavlink_in: bool = True
    """Heartbeats of a ground station arrive."""
    mavlink_out: bool = True
    mavlink_required: bool = False
    """A ground station was heard since the start, so its loss counts."""
    tasks_running: bool = True
    outputs: bool = True
    motors: bool = True
    """No motor has failed."""
    attitude_known: bool = False
    position_known: bool = False
    gps_fix: bool = False
    gps_believed: bool = True
    compass_believed: bool = True
    barometer_moving: bool = True
    vibration_low: bool = True
    battery_volts_ok: bool = True
    battery_flat: bool = False
    heading_known: bool = True
    """Confirmed by a compass that nothing disturbs, or by the way in which it moves."""
    in_place: bool = True
    """Near the reference: False in wind that is too strong."""
    far_away: bool = False
    """So far from the reference that it must not fly on."""
    armed: bool = False


def check_init(health: Health) -> list[Fault]:
    """What must be there: sensors and outputs."""
    faults = [Fault(f"{sensor} not found", Weight.MAJOR) for sensor in Sensor if sensor not in health.present]
    if not health.outputs:
        faults.append(Fault("Motor outputs not found", Weight.MAJOR))
    return faults


def check_startup(health: Health) -> list[Fault]:
    """What must be ready: calibrations, tasks, attitude."""
    faults = [Fault(f"{sensor} not calibrated") for sensor in Sensor if sensor not in health.calibrated]
    if not health.tasks_running:
        faults.append(Fault("Control tasks not running", Weight.MAJOR))
    if not health.attitude_known:
        faults.append(Fault("Attitude unknown", Weight.MAJOR))
    return faults


def check_run_manual(health: Health) -> list[Fault]:
    """What flying with sticks needs."""
    faults = []
    if health.radio_required and not health.radio:
        faults.append(Fault("Radio lost"))
    return [*faults, *_machine(health)]


def check_run_auto(health: Health) -> list[Fault]:
    """What flying without sticks needs."""
    faults = []
    if not health.gps_fix:
        faults.append(Fault("GPS lost"))
    elif not health.gps_believed:
        faults.append(Fault("GPS glitch"))
    if not health.position_known:
        faults.append(Fault("Position unknown"))
    if health.mavlink_required and not (health.mavlink_in and health.mavlink_out):
        faults.append(Fault("MAVLink lost"))
    if health.far_away:
        faults.append(Fault("Too far from its place", Weight.MAJOR))
    elif not health.in_place:
        faults.append(Fault("Blown away"))
    return [*faults, *_machine(health)]


def _machine(health: Health) -> list[Fault]:
    return [
        fault
        for bad, fault in (
            (not health.motors, Fault("Motor failure", Weight.MAJOR)),
            (health.battery_flat, Fault("Battery empty", Weight.MAJOR)),
            (not health.battery_volts_ok, Fault("Battery voltage low")),
            (not health.attitude_known, Fault("Attitude unknown", Weight.MAJOR)),
            (not health.compass_believed, Fault("Compass inconsistent")),
            (not health.heading_known, Fault("Heading doubtful")),
            (not health.barometer_moving, Fault("Barometer stuck")),
            (not health.vibration_low, Fault("Vibration high")),
        )
        if bad
    ]


LANDS_AFTER_S: Final[Mapping[str, float]] = {
    "Position unknown": 20.0,
    "GPS glitch": 30.0,
    "Compass inconsistent": 30.0,
    "Heading doubtful": 30.0,
    "Blown away": 30.0,
}
"""Minor faults that leave it open where a vehicle goes: after so long it lands."""
TOO_LONG: Final = Fault("In doubt for too long", Weight.MAJOR)


def worst(faults: Iterable[Fault]) -> Weight | None:
    return max((fault.weight for fault in faults), default=None)
