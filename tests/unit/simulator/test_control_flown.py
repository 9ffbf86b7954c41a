"""The cascade follows its references on the filter's estimate: times of arrival, an eight, wind, saturation."""

from __future__ import annotations

import numpy as np
import pytest

from simulator.control.cascade import Cascade, Gains, Motion
from simulator.control.figure_of_eight import FigureOfEight
from simulator.control.reference import standing
from simulator.control.trajectory import Trajectory, WayPoint, plan
from simulator.firmware.controller import Fleet, FleetSettings
from simulator.firmware.recorder import Recorder, level
from simulator.firmware.states import SystemState
from simulator.physics.frames import Frame
from simulator.physics.quadrotor import Quadrotors
from simulator.physics.quadrotor_design import QuadrotorDesign
from simulator.physics.rotation import level as level_attitude

DESIGN = QuadrotorDesign()
NEAR_M = 0.3


def ready(count: int = 4, **settings: float) -> Fleet:
    fleet = Fleet(FleetSettings(count=count, dt_s=0.01, **settings))  # type: ignore[arg-type]
    fleet.boot()
    fleet.arm()
    return fleet


def fly(fleet: Fleet, trajectory: Trajectory | FigureOfEight, duration_s: float) -> Recorder:
    recorder, began_s = Recorder(fleet, period_s=0.02), fleet.now_s
    while fleet.now_s < began_s + duration_s - 1e-9:
        fleet.step(trajectory.at(fleet.now_s - began_s))
        recorder.note()
    return recorder


def test_times_of_arrival_are_met_and_the_landing_disarms() -> None:
    """Arrived: within 30 cm of the way-point, for the vehicle as for the reference."""
    points = [WayPoint(10, 0, 6, 10.0), WayPoint(10, 8, 6, 16.0), WayPoint(0, 0, 6, 23.0)]
    trajectory = plan(points, take_off_m=6.0)
    fleet = ready(wind_mps=3.0)
    recorder = fly(fleet, trajectory, trajectory.duration_s + 1.0)
    times_s = np.array(recorder.times_s) - recorder.times_s[0]
    place, wanted = recorder.column("estimate_m"), recorder.column("reference_m")
    for point in points:
        goal = np.array([point.north_m, point.east_m, -point.alt_m])[:, np.newaxis]
        assert point.arrive_s is not None
        meanwhile = (times_s > point.arrive_s - 3.0) & (times_s < point.arrive_s + 2.0)
        due_s = times_s[meanwhile][np.argmax(np.linalg.norm(wanted[meanwhile] - goal, axis=1) < NEAR_M, axis=0)]
        come = np.linalg.norm(place[meanwhile] - goal, axis=1) < NEAR_M
        assert come.any(axis=0).all()
        assert np.abs(times_s[meanwhile][np.argmax(come, axis=0)] - due_s).max() < 0.2
    assert fleet.landed.all()
    assert {c.state for c in fleet.commanders} == {SystemState.SAFE}


def test_an_eight_stays_within_half_a_metre() -> None:
    fleet = ready()
    up = plan([], take_off_m=6.0, land=False)
    fly(fleet, up, up.duration_s + 1.0)
    eight = FigureOfEight(8.0, 14.0, 6.0, rounds=1)
    off_m = fly(fleet, eight, eight.duration_s).tracking_error_m()
    assert level(off_m).max() < 0.5
    assert np.abs(off_m[:, 2]).max() < 0.5


def test_a_hover_in_strong_wind_stays_within_a_metre() -> None:
    """For the controller and in truth; each of the twenty has noise and gusts of its own."""
    fleet = ready(count=20, wind_mps=8.0)
    up = plan([], take_off_m=6.0, land=False)
    fly(fleet, up, up.duration_s + 4.0)
    recorder = fly(fleet, Trajectory(up.end_m), 20.0)
    off_m = recorder.tracking_error_m()
    assert level(off_m).max() < 0.6
    assert level(off_m).max(axis=0).min() > 0.05, "there is wind"
    truth_off_m = recorder.column("reference_m") - recorder.column("position_m")
    assert level(truth_off_m).max() < 1.0
    assert level(truth_off_m).max() > level(off_m).max(), "a filter that sees the truth proves nothing"


def held_in_wind(wind_mps: float, *, learning: bool, seconds: float = 25.0) -> float:
    """Metres off its place at last, on the true motion, in a steady wind."""
    body, cascade = Quadrotors(DESIGN), Cascade(DESIGN, 1, wind_learning=learning)
    body.position_m[2], body.rotor_rps[:] = -20.0, DESIGN.hover_speed_rps
    wind, hover = np.array([[wind_mps], [0.0], [0.0]]), standing(np.array([0.0, 0.0, -20.0]))
    for _ in range(round(seconds / 0.01)):
        motion = Motion(body.position_m, body.velocity_mps, body.attitude, body.rates_rps)
        body.step(cascade.commands(motion, hover, 0.01), 0.01, wind)
    return float(np.hypot(body.position_m[0, 0], body.position_m[1, 0]))


def test_pd_alone_is_blown_aside_and_the_integral_brings_it_back() -> None:
    assert held_in_wind(8.0, learning=False) > 0.5
    assert held_in_wind(8.0, learning=True) < 0.05


def test_an_integral_does_not_wind_up_while_the_wind_is_too_strong() -> None:
    """Held back for 6 s by what it cannot overcome, it must not shoot past its place afterwards."""
    body, cascade = Quadrotors(DESIGN), Cascade(DESIGN, 1, Gains(max_lean_rad=0.2))
    body.position_m[2], body.rotor_rps[:] = -20.0, DESIGN.hover_speed_rps
    hover = standing(np.array([0.0, 0.0, -20.0]))
    farthest_m = 0.0
    for i in range(2600):
        wind = np.array([[-9.0 if i < 600 else 0.0], [0.0], [0.0]])
        motion = Motion(body.position_m, body.velocity_mps, body.attitude, body.rates_rps)
        body.step(cascade.commands(motion, hover, 0.01), 0.01, wind)
        if i >= 600:
            farthest_m = max(farthest_m, float(body.position_m[0, 0]))
    assert farthest_m < 4.0
    assert abs(body.position_m[0, 0]) < 0.1


@pytest.mark.parametrize("frame", Frame)
def test_each_frame_recovers_from_a_wild_attitude(frame: Frame) -> None:
    design = QuadrotorDesign(frame=frame)
    body, cascade = Quadrotors(design), Cascade(design, 1)
    body.position_m[2], body.rotor_rps[:] = -30.0, design.hover_speed_rps
    body.rates_rps[:, 0] = [4.0, -3.0, 1.0]
    hover = standing(np.array([0.0, 0.0, -30.0]), yaw_rad=1.0)
    for _ in range(1200):
        motion = Motion(body.position_m, body.velocity_mps, body.attitude, body.rates_rps)
        body.step(cascade.commands(motion, hover, 0.01), 0.01, np.zeros((3, 1)))
    np.testing.assert_allclose(body.position_m[:, 0], [0.0, 0.0, -30.0], atol=0.1)
    np.testing.assert_allclose(np.abs(body.attitude), np.abs(level_attitude(1, 1.0)), atol=0.02)
