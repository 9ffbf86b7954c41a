"""The sensors of a flight controller, read together once a step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simulator.physics.quadrotor import Quadrotors
from simulator.physics.rotation import Floats
from simulator.sensors.barometer import Barometer
from simulator.sensors.cells import Batteries
from simulator.sensors.inertial import ACCELEROMETER, GYROSCOPE, Inertial
from simulator.sensors.magnetometer import Magnetometer
from simulator.sensors.sampling import Reading
from simulator.sensors.satellites import GpsReceiver


@dataclass(frozen=True, slots=True)
class Readings:
    """Of one step. A sensor that measures more rarely is None in between."""

    now_s: float
    acceleration_mss: Floats
    rates_rps: Floats
    magnetometer: Reading | None
    barometer: Reading | None
    gps: Reading | None


class SensorBoard:
    def __init__(self, count: int, seed: int, *, warm_start: bool = False, battery_mah: float = 5200.0) -> None:
        """`warm_start`: GPS has its fix at once. Each sensor has a random source of its own, so that a change of one
        leaves the others' noise as it was."""
        sources = [np.random.default_rng((seed, number)) for number in range(6)]
        self.accelerometer = Inertial(ACCELEROMETER, count, sources[0])
        self.gyroscope = Inertial(GYROSCOPE, count, sources[1])
        self.magnetometer = Magnetometer(count, sources[2])
        self.barometer = Barometer(count, sources[3])
        self.gps = GpsReceiver(count, sources[4], warm_start=warm_start)
        self.batteries = Batteries(count, sources[5], battery_mah)

    def read(self, body: Quadrotors, now_s: float, dt_s: float) -> Readings:
        load = body.thrust_n.sum(axis=0) / body.design.weight_n
        self.batteries.step(load, dt_s)
        return Readings(
            now_s,
            self.accelerometer.read(body.specific_force_mss, load, dt_s),
            self.gyroscope.read(body.rates_rps, load, dt_s),
            self.magnetometer.step(body.rotation, now_s),
            self.barometer.step(body.alt_m, now_s),
            self.gps.step(body.position_m, body.velocity_mps, now_s),
        )
