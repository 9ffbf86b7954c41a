"""Faults by name, and what has to follow from each in automatic flight: `TABLE`, which is also the documentation's.

How a fault is made is elsewhere: in a fleet by `firmware.faults`, in a vehicle of `tower-sim` by the failure modes that
`Consequence.failure` names. What follows is the same.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from simulator.failure_modes import Failure
from simulator.firmware.states import SystemState


class FaultName(StrEnum):
    GPS_LOSS = "gps_loss"
    GPS_JUMP = "gps_jump"
    COMPASS_JUMP = "compass_jump"
    MOTOR_LOSS = "motor_loss"
    BATTERY_SAG = "battery_sag"
    RADIO_LOSS = "radio_loss"
    IMU_NOISE = "imu_noise"
    MAVLINK_MUTE = "mavlink_mute"
    STUCK_BARO = "stuck_baro"
    WIND_GUST = "wind_gust"


FAILSAFE, ERROR, SILENT, NONE = "failsafe", "autopilot-error", "silent", ""
"""Alerts of the tower (docs/alerts.md): two for texts of an armed autopilot, one for its silence."""


@dataclass(frozen=True, slots=True)
class Consequence:
    """`text`: what STATUSTEXT says; `state`: where the commander goes from SYS_RUN_AUTO; `alert`: what it means to a
    person; `rule`: the alert that the tower raises."""

    failure: Failure
    text: str
    state: SystemState
    alert: str
    rule: str
    within_s: float
    """Seconds from the fault to the state."""
    needs_sensors: bool = False
    """An airframe that knows the truth (`--model exact`) cannot have it."""


_MINOR, _MAJOR, _AUTO = SystemState.FAIL_MINOR, SystemState.FAIL_MAJOR, SystemState.RUN_AUTO
_F = Failure

TABLE: Mapping[FaultName, Consequence] = {
    FaultName.GPS_LOSS: Consequence(_F.GPS_LOST, "GPS lost", _MINOR, "no position from satellites", ERROR, 1.0),
    FaultName.GPS_JUMP: Consequence(_F.GPS_JUMP, "GPS glitch", _MINOR, "positions contradict", ERROR, 2.0, True),
    FaultName.COMPASS_JUMP: Consequence(
        _F.COMPASS_JUMP, "Compass inconsistent", _MINOR, "heading is doubtful", ERROR, 2.0, True
    ),
    FaultName.MOTOR_LOSS: Consequence(
        _F.MOTOR_LOST, "Motor failure", _MAJOR, "it falls or lands at once", FAILSAFE, 3.0
    ),
    FaultName.BATTERY_SAG: Consequence(_F.BATTERY_SAG, "Battery voltage low", _MINOR, "land soon", ERROR, 6.0),
    FaultName.RADIO_LOSS: Consequence(_F.RADIO_LOST, "", _AUTO, "", NONE, 1.0),
    FaultName.IMU_NOISE: Consequence(_F.IMU_NOISE, "Vibration high", _MINOR, "check propellers", ERROR, 3.0, True),
    FaultName.MAVLINK_MUTE: Consequence(_F.MAVLINK_MUTE, "MAVLink lost", _MINOR, "link is silent", SILENT, 4.5),
    FaultName.STUCK_BARO: Consequence(_F.BARO_STUCK, "Barometer stuck", _MINOR, "height is doubtful", ERROR, 3.0, True),
    FaultName.WIND_GUST: Consequence(_F.WIND_GUST, "Blown away", _MINOR, "away from its place", ERROR, 6.0),
}
"""Sticks do not fly in SYS_RUN_AUTO, so there the loss of the radio is no fault of the commander's. In SYS_RUN_MANUAL
it is: "Radio lost", SYS_FAIL_MINOR. ArduCopter's and PX4's own failsafes act besides."""


def parse(text: str) -> tuple[FaultName, float, float]:
    """Parses `NAME`, `NAME@FROM` or `NAME@FROM-UNTIL`: name, and seconds since switch-on; from 0 and for ever if it
    does not say. Raises ValueError."""
    name, _, times = text.partition("@")
    at, _, until = times.partition("-")
    try:
        planned = FaultName(name), float(at) if times else 0.0, float(until) if until else math.inf
    except ValueError:
        planned = None
    if planned is None or not 0.0 <= planned[1] < planned[2]:
        raise ValueError(f"{text!r} is not NAME[@SECONDS[-SECONDS]] with NAME one of {', '.join(FaultName)}")
    return planned
