"""What each fault does to one vehicle of a fleet. It can be taken back, except what breaks for good.

What has to follow is in `fault_table.TABLE`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from simulator.firmware.controller import Fleet
from simulator.firmware.fault_table import FaultName

JUMP_M = 40.0
"""North and east. Satellites that stay there for 7 s are believed in the end, and the vehicle flies there."""
JUMP_GAUSS = 0.35
SAG_OHM = 0.2
NOISE_FACTOR = 12.0
GUST_MPS = 22.0
GUST_S = 6.0


Action = Callable[[Fleet, int], None]


def _gps(lost: bool) -> Action:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.board.gps.lost[vehicle] = lost

    return act


def _gps_jump(metres: float) -> Action:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.board.gps.jump_m[:2, vehicle] = metres

    return act


def _compass_jump(gauss: float) -> Action:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.board.magnetometer.jump_gauss[1, vehicle] = gauss

    return act


def _motor(health: float) -> Action:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.body.motor_health[0, vehicle] = health

    return act


def _sag(ohm: float) -> Action:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.board.batteries.extra_resistance_ohm[vehicle] = ohm

    return act


def _radio(heard: bool) -> Action:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.monitor.radio[vehicle] = heard

    return act


def _noise(factor: float) -> Action:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.board.accelerometer.noise_factor[vehicle] = factor
        fleet.board.gyroscope.noise_factor[vehicle] = factor

    return act


def _mavlink(heard: bool) -> Action:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.monitor.mavlink_required[vehicle] = True
        fleet.monitor.mavlink_in[vehicle] = fleet.monitor.mavlink_out[vehicle] = heard

    return act


def _stuck(stuck: bool) -> Action:
    def act(fleet: Fleet, vehicle: int) -> None:
        fleet.board.barometer.stuck[vehicle] = stuck

    return act


def _gust(fleet: Fleet, vehicle: int) -> None:
    heading = 2.0 * math.pi * ((vehicle * 0.618) % 1.0)
    velocity = (GUST_MPS * math.cos(heading), GUST_MPS * math.sin(heading), 0.0)
    fleet.air.gust(vehicle, velocity, fleet.now_s, GUST_S)


def _calm(fleet: Fleet, vehicle: int) -> None:
    fleet.air.gust(vehicle, (0.0, 0.0, 0.0), fleet.now_s, GUST_S)


_ACTIONS: Mapping[FaultName, tuple[Action, Action]] = {
    FaultName.GPS_LOSS: (_gps(True), _gps(False)),
    FaultName.GPS_JUMP: (_gps_jump(JUMP_M), _gps_jump(0.0)),
    FaultName.COMPASS_JUMP: (_compass_jump(JUMP_GAUSS), _compass_jump(0.0)),
    FaultName.MOTOR_LOSS: (_motor(0.0), _motor(1.0)),
    FaultName.BATTERY_SAG: (_sag(SAG_OHM), _sag(0.0)),
    FaultName.RADIO_LOSS: (_radio(False), _radio(True)),
    FaultName.IMU_NOISE: (_noise(NOISE_FACTOR), _noise(1.0)),
    FaultName.MAVLINK_MUTE: (_mavlink(False), _mavlink(True)),
    FaultName.STUCK_BARO: (_stuck(True), _stuck(False)),
    FaultName.WIND_GUST: (_gust, _calm),
}
"""What begins and what ends each."""


def begin(fleet: Fleet, name: FaultName, vehicle: int = 0) -> None:
    _ACTIONS[name][0](fleet, vehicle)


def end(fleet: Fleet, name: FaultName, vehicle: int = 0) -> None:
    _ACTIONS[name][1](fleet, vehicle)
