"""A compass is calibrated in flight, by its own vehicle, without knowing the truth."""

from __future__ import annotations

import numpy as np

from simulator.firmware.calibration_flight import calibrate
from simulator.firmware.controller import Fleet, FleetSettings
from simulator.firmware.recorder import Recorder
from simulator.firmware.states import SystemState
from simulator.sensors.magnetometer_calibration import MagnetometerCalibration


def heading_errors_deg(fleet: Fleet) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    recorder = Recorder(fleet)
    recorder.note()
    return np.abs(recorder.column("attitude_error_deg")[0, 2])


def test_a_calibration_flight_finds_the_iron_and_lands() -> None:
    fleet = Fleet(FleetSettings(count=4, dt_s=0.01, calibrated=False))
    fleet.boot()
    assert heading_errors_deg(fleet).max() > 15.0
    fleet.arm()
    calibration = calibrate(fleet)
    compass = fleet.board.magnetometer
    assert np.abs(calibration.offset_gauss - compass.hard_iron_gauss).max() < 0.015
    assert {c.state for c in fleet.commanders} == {SystemState.SAFE}
    # Saved, loaded by another flight controller with the same sensors, and started from cold.
    again = Fleet(FleetSettings(count=4, dt_s=0.01, calibrated=False, yaw_rad=1.0))
    again.load_calibration(MagnetometerCalibration.from_json(calibration.to_json()))
    again.boot()
    assert heading_errors_deg(again).max() < 5.0
