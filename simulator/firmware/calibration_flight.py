"""The flown calibration of a compass: an eight while the nose turns, with the compass left out of the filter.

The heading then comes from the gyroscope, and from what GPS and accelerometer say of each turn. It is right but for a
part that hardly changes, which is what the fit allows for.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simulator.control.figure_of_eight import FigureOfEight
from simulator.control.trajectory import PlanLimits, Trajectory, plan
from simulator.firmware.controller import Fleet
from simulator.physics.rotation import Floats
from simulator.sensors.magnetometer import earth_field_gauss
from simulator.sensors.magnetometer_calibration import MagnetometerCalibration, fit

ALT_M = 8.0
SAMPLE_S = 0.1
TURN_S = 9.0
"""For one turn of the nose."""
_EIGHT = FigureOfEight(6.0, 11.5, ALT_M, rounds=3)


def calibrate(fleet: Fleet) -> MagnetometerCalibration:
    """Flies armed vehicles from the ground and back, and gives them the calibration. Raises CalibrationRefused; the
    vehicles have landed then too, with the calibration that they had."""
    navigation, compass = fleet.filter, fleet.board.magnetometer
    navigation.compass_trusted[:] = False
    up = plan([], take_off_m=ALT_M, land=False)
    _fly(fleet, up, up.duration_s + 1.0)
    samples: list[Floats] = []
    attitudes: list[Floats] = []
    began_s, due_s = fleet.now_s, fleet.now_s + 0.3 * _EIGHT.duration_s
    while fleet.now_s < began_s + _EIGHT.duration_s:
        time_s = fleet.now_s - began_s
        fleet.step(replace(_EIGHT.at(time_s), yaw_rad=2.0 * np.pi * time_s / TURN_S))
        if fleet.now_s >= due_s:  # the heading has settled
            due_s += SAMPLE_S
            samples.append(compass.raw_gauss(fleet.body.rotation))
            attitudes.append(navigation.state.attitude.copy())
    down = Trajectory(_EIGHT.at(_EIGHT.duration_s).position_m)
    down.land(PlanLimits())
    _fly(fleet, down, down.duration_s + 2.0)
    navigation.compass_trusted[:] = True
    compass.calibration = fit(np.stack(samples, axis=2), np.stack(attitudes, axis=2), earth_field_gauss())
    return compass.calibration


def _fly(fleet: Fleet, way: Trajectory, duration_s: float) -> None:
    began_s = fleet.now_s
    while fleet.now_s < began_s + duration_s:
        fleet.step(way.at(fleet.now_s - began_s))
