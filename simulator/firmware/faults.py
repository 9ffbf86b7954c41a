"""Faults by name, what each does to the machine, and what has to follow from it in automatic flight.

`TABLE` is also the documentation's table. A fault acts on one vehicle of a fleet and can be taken back, except what
breaks for good.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from simulator.firmware.controller import Fleet
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


JUMP_M = 40.0
"""North and east. Satellites that stay there for 7 s are believed in the end, and the vehicle flies there."""
JUMP_GAUSS = 0.35
SAG_OHM = 0.2
NOISE_FACTOR = 12.0
GUST_MPS = 22.0
GUST_S = 6.0


@dataclass(frozen=True, slots=True)
class FaultRow:
    """`text`: what STATUSTEXT says; `state`: where the commander goes from SYS_RUN_AUTO; `alert`: what it means to a
    person."""

    begin: Callable[[Fleet, int], None]
    end: Callable[[Fleet, int], None]
    text: str
    state: SystemState
    alert: str
    within_s: float
    """Seconds from the fault to the state."""


def _gps(lost: bool) -> Callable[[Fleet, int], None]:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.board.gps.lost[vehicle] = lost

    return act


def _gps_jump(metres: float) -> Callable[[Fleet, int], None]:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.board.gps.jump_m[:2, vehicle] = metres

    return act


def _compass_jump(gauss: float) -> Callable[[Fleet, int], None]:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.board.magnetometer.jump_gauss[1, vehicle] = gauss

    return act


def _motor(health: float) -> Callable[[Fleet, int], None]:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.body.motor_health[0, vehicle] = health

    return act


def _sag(ohm: float) -> Callable[[Fleet, int], None]:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.board.batteries.extra_resistance_ohm[vehicle] = ohm

    return act


def _radio(heard: bool) -> Callable[[Fleet, int], None]:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.monitor.radio[vehicle] = heard

    return act


def _noise(factor: float) -> Callable[[Fleet, int], None]:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.board.accelerometer.noise_factor[vehicle] = factor
        fleet.board.gyroscope.noise_factor[vehicle] = factor

    return act


def _mavlink(heard: bool) -> Callable[[Fleet, int], None]:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.monitor.mavlink_required[vehicle] = True
        fleet.monitor.mavlink_in[vehicle] = fleet.monitor.mavlink_out[vehicle] = heard

    return act


def _stuck(stuck: bool) -> Callable[[Fleet, int], None]:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.board.barometer.stuck[vehicle] = stuck

    return act


def _gust(fleet: Fleet, vehicle: int) -> None:
    heading = 2.0 * math.pi * ((vehicle * 0.618) % 1.0)
    velocity = (GUST_MPS * math.cos(heading), GUST_MPS * math.sin(heading), 0.0)
    fleet.air.gust(vehicle, velocity, fleet.now_s, GUST_S)


def _calm(fleet: Fleet, vehicle: int) -> None:
    fleet.air.gust(vehicle, (0.0, 0.0, 0.0), fleet.now_s, GUST_S)


MINOR, MAJOR, AUTO = SystemState.FAIL_MINOR, SystemState.FAIL_MAJOR, SystemState.RUN_AUTO

TABLE: Mapping[FaultName, FaultRow] = {
    FaultName.GPS_LOSS: FaultRow(_gps(True), _gps(False), "GPS lost", MINOR, "no position from satellites", 1.0),
    FaultName.GPS_JUMP: FaultRow(_gps_jump(JUMP_M), _gps_jump(0.0), "GPS glitch", MINOR, "positions contradict", 2.0),
    FaultName.COMPASS_JUMP: FaultRow(
        _compass_jump(JUMP_GAUSS), _compass_jump(0.0), "Compass inconsistent", MINOR, "heading is doubtful", 2.0
    ),
    FaultName.MOTOR_LOSS: FaultRow(_motor(0.0), _motor(1.0), "Motor failure", MAJOR, "it falls or lands at once", 3.0),
    FaultName.BATTERY_SAG: FaultRow(_sag(SAG_OHM), _sag(0.0), "Battery voltage low", MINOR, "land soon", 6.0),
    FaultName.RADIO_LOSS: FaultRow(_radio(False), _radio(True), "", AUTO, "", 1.0),
    FaultName.IMU_NOISE: FaultRow(_noise(NOISE_FACTOR), _noise(1.0), "Vibration high", MINOR, "check propellers", 3.0),
    FaultName.MAVLINK_MUTE: FaultRow(_mavlink(False), _mavlink(True), "MAVLink lost", MINOR, "link is silent", 1.0),
    FaultName.STUCK_BARO: FaultRow(_stuck(True), _stuck(False), "Barometer stuck", MINOR, "height is doubtful", 3.0),
    FaultName.WIND_GUST: FaultRow(_gust, _calm, "Blown away", MINOR, "away from its place", 6.0),
}
"""Sticks do not fly in SYS_RUN_AUTO, so there the loss of the radio is no fault. In SYS_RUN_MANUAL it is: "Radio lost",
SYS_FAIL_MINOR."""


def begin(fleet: Fleet, name: FaultName, vehicle: int = 0) -> None:
    TABLE[name].begin(fleet, vehicle)


def end(fleet: Fleet, name: FaultName, vehicle: int = 0) -> None:
    TABLE[name].end(fleet, vehicle)
