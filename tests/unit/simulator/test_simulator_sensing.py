"""`--model sensing`: the modes of ArduCopter fly on what a filter makes of sensors with errors."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from simulator.airframe_model import AirframeModel
from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.guided import GoTo
from simulator.modes import Mode
from simulator.reports_motion import gps_raw
from simulator.sensors.satellites import Fix
from simulator.squad import make_squad, step_together
from simulator.vehicle import Vehicle, VehicleSettings

MakeGround = Callable[..., Any]
HOME = Place(47.3977, 8.5456, 488.0)


def apart_m(station: Any) -> float:
    """How far the vehicle is from where it believes to be."""
    body = station.body
    north_m, east_m, height_m, _ = body.true_pose
    return math.dist((north_m, east_m, height_m), (body.north_m, body.east_m, body.alt_m))


def test_it_takes_off_holds_and_lands_on_its_estimate(ground: MakeGround) -> None:
    station = ground(model=AirframeModel.SENSING, wind_mps=4.0, boot_s=2.0).take_off(6.0)
    station.run(3.0)
    assert station.body.true_pose[2] == pytest.approx(6.0, abs=0.6)
    assert 0.0 < apart_m(station) < 2.0, "it believes, it does not know"
    assert station.tilt_deg() > 1.0, "there is wind"
    assert station.set_mode(Mode.LAND) == mavlink.MAV_RESULT_ACCEPTED
    station.until(lambda: not station.flight.armed)
    assert station.body.true_pose[2] == pytest.approx(0.0, abs=0.05)


def test_without_gps_its_position_drifts_and_it_lands_as_measured(ground: MakeGround) -> None:
    station = ground(model=AirframeModel.SENSING, boot_s=2.0).take_off(4.0)
    station.flight.failures.add(Failure.GPS_LOST)
    station.until(lambda: station.flight.mode is Mode.LAND, timeout_s=12.0)
    assert "EKF Failsafe: changed to LAND Mode" in station.texts()
    assert bool(station.body.group.board.gps.lost[0])
    assert station.now_s - station.body.group.filter.gps_accepted_s[0] > 5.0


def test_its_receiver_claims_no_more_than_it_has(ground: MakeGround) -> None:
    claims = {model: gps_raw(ground(model=model, boot_s=1.0).ready().flight) for model in AirframeModel}
    assert claims[AirframeModel.EXACT].fix_type == mavlink.GPS_FIX_TYPE_RTK_FIXED
    assert claims[AirframeModel.SENSING].fix_type == mavlink.GPS_FIX_TYPE_3D_FIX
    assert claims[AirframeModel.SENSING].h_acc > 1500, "millimetres"


def test_a_gps_that_comes_back_is_no_glitch(ground: MakeGround) -> None:
    station = ground(model=AirframeModel.SENSING, boot_s=2.0).take_off(4.0)
    station.flight.failures.add(Failure.GPS_LOST)
    station.run(3.0)
    station.flight.failures.discard(Failure.GPS_LOST)
    station.until(lambda: station.body.group.board.gps.fix[0] >= Fix.FIX_3D)
    station.run(2.0)
    assert "GPS glitch" not in station.texts()
    assert station.body.group.filter.gps_accepted_s[0] > station.now_s - 0.5


def test_each_failure_of_a_sensor_is_told_once_and_flown_with(ground: MakeGround) -> None:
    station = ground(model=AirframeModel.SENSING, boot_s=2.0).take_off(5.0)
    assert max(station.body.innovations()) < 1.0
    texts = {
        Failure.GPS_JUMP: "GPS glitch",
        Failure.COMPASS_JUMP: "Compass inconsistent",
        Failure.IMU_NOISE: "Vibration high",
        Failure.BARO_STUCK: "Barometer stuck",
    }
    for failure, text in texts.items():
        assert text not in station.texts()
        station.flight.failures.add(failure)
        station.run(2.5)
        assert station.texts().count(text) == 1, failure
        if failure is Failure.GPS_JUMP:
            station.run(0.1)
            assert station.body.innovations()[1] > 1.0, "EKF_STATUS_REPORT shows it"
        station.flight.failures.discard(failure)
        station.run(1.0)
    assert station.body.true_pose[2] == pytest.approx(5.0, abs=1.5)
    assert station.tilt_deg() < 20.0


def test_the_same_seed_gives_the_same_bytes_and_another_one_others(ground: MakeGround) -> None:
    def believed(seed: int) -> list[float]:
        station = ground(model=AirframeModel.SENSING, seed=seed, boot_s=1.0).ready()
        station.run(0.5)
        body = station.body
        return [body.north_m, body.alt_m, body.qx, *np.ravel(body.group.board.gyroscope.bias)]

    assert believed(1) == believed(1)
    assert believed(1) != believed(2)


@pytest.fixture
def squad() -> list[Vehicle]:
    """Three in wind, with the commander, just ready to arm."""
    flight = FlightSettings(HOME, boot_s=1.0, wind_mps=4.0, model=AirframeModel.SENSING, commander=True)
    vehicles = make_squad(3, VehicleSettings(flight))
    step_together(vehicles, 2.0)
    return vehicles


def test_a_squad_flies_on_one_group_each_with_an_error_of_its_own(squad: list[Vehicle]) -> None:
    bodies = [vehicle.flight.body for vehicle in squad]
    for vehicle, height_m in zip(squad, (3.0, 4.0, 5.0), strict=True):
        vehicle.flight.set_mode(Mode.GUIDED)
        assert vehicle.flight.arm()
        assert vehicle.flight.flying.take_off(height_m)
    step_together(squad, 11.0)
    for body, height_m in zip(bodies, (3.0, 4.0, 5.0), strict=True):
        assert body.true_pose[2] == pytest.approx(height_m, abs=0.6)
        assert math.hypot(*body.true_pose[:2]) < 1.5
    errors = [body.true_pose[0] - body.north_m for body in bodies]
    assert len(set(errors)) == 3
    squad[1].failures.add(Failure.MOTOR_LOST)
    step_together(squad, 14.0)
    assert [vehicle.flight.armed for vehicle in squad] == [True, False, True], "a fault hits one alone"
    assert bodies[0].true_pose[2] == pytest.approx(3.0, abs=0.6)


def test_who_flies_fast_in_still_air_is_not_blown_away() -> None:
    flight = FlightSettings(HOME, boot_s=1.0, model=AirframeModel.SENSING, commander=True)
    vehicles = make_squad(4, VehicleSettings(flight))
    step_together(vehicles, 2.0)
    for vehicle in vehicles:
        vehicle.flight.set_mode(Mode.GUIDED)
        assert vehicle.flight.arm()
        assert vehicle.flight.flying.take_off(3.0)
    step_together(vehicles, 8.0)
    for vehicle in vehicles:
        vehicle.flight.flying.go(GoTo(100.0, 0.0, 3.0))
    step_together(vehicles, 16.0)
    for vehicle in vehicles:
        assert vehicle.flight.target.vn_mps > 8.0
        assert "Blown away" not in vehicle.said


def test_one_of_a_squad_restarts_and_flies_again(squad: list[Vehicle]) -> None:
    other, again = squad[0], squad[2]
    other.flight.set_mode(Mode.GUIDED)
    assert other.flight.arm()
    assert other.flight.flying.take_off(3.0)
    step_together(squad, 7.0)
    again.restart_soon()
    step_together(squad, 7.1)
    assert not again.flight.estimator.position_ok
    assert again.flight.body.attitude()[2] == pytest.approx(0.0, abs=0.1)
    step_together(squad, 11.0)
    assert again.flight.body.contradictions() == ()
    again.flight.set_mode(Mode.GUIDED)
    assert again.flight.arm()
    assert again.flight.flying.take_off(3.0)
    step_together(squad, 17.0)
    for vehicle in (other, again):
        north_m, east_m, height_m, _ = vehicle.flight.body.true_pose
        assert height_m == pytest.approx(3.0, abs=0.6)
        assert math.hypot(north_m, east_m) < 1.5


def test_a_squad_is_stepped_in_turn(squad: list[Vehicle]) -> None:
    with pytest.raises(RuntimeError, match="stepped twice"):
        squad[0].step(3.0)


def test_the_exact_model_needs_no_numpy() -> None:
    """A drone's machine, or a small server, flies the default without it."""
    code = "import sys, simulator.cli; assert 'numpy' not in sys.modules, 'numpy was imported'"
    assert subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True).stderr == ""
