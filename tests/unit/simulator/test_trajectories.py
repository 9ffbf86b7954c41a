"""Trajectories keep their limits and their times, and refuse what cannot be flown."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.control.figure_of_eight import EightFlight, FigureOfEight
from simulator.control.reference import Reference
from simulator.control.trajectory import PlanLimits, Trajectory, TrajectoryRefused, WayPoint, plan
from simulator.control.trapezoid import TooFast, fastest, lasting

LIMITS = PlanLimits()


@given(distance=st.floats(0.01, 500.0), slower=st.floats(1.0, 5.0))
def test_a_trapezoid_arrives_in_its_time_and_keeps_its_limits(distance: float, slower: float) -> None:
    best = fastest(distance, 6.0, 2.0)
    motion = lasting(distance, best.duration_s * slower, 6.0, 2.0)
    assert motion.duration_s == pytest.approx(best.duration_s * slower, rel=1e-6)
    assert motion.cruise_mps <= 6.0 + 1e-9
    assert motion.at(motion.duration_s)[0] == pytest.approx(distance)
    gone = [motion.at(motion.duration_s * i / 50)[0] for i in range(51)]
    assert gone == sorted(gone)
    with pytest.raises(TooFast):
        lasting(distance, best.duration_s * 0.99, 6.0, 2.0)


def _consistent(at: object, duration_s: float) -> None:
    """Velocity is the change of position and acceleration that of velocity."""
    step_s = 1e-4
    for i in range(1, 60):
        time_s = duration_s * i / 60.03
        before, now, after = (at(time_s + d) for d in (-step_s, 0.0, step_s))  # type: ignore[operator]
        assert isinstance(now, Reference)
        np.testing.assert_allclose((after.position_m - before.position_m) / (2 * step_s), now.velocity_mps, atol=2e-3)
        np.testing.assert_allclose(
            (after.velocity_mps - before.velocity_mps) / (2 * step_s), now.acceleration_mss, atol=2e-2
        )


def test_a_plan_is_a_motion() -> None:
    trajectory = plan([WayPoint(10, 5, 12), WayPoint(-4, 5, 6, 25.0)], take_off_m=10.0, pause_s=1.0)
    _consistent(trajectory.at, trajectory.duration_s)


def test_an_eight_is_a_motion_that_begins_and_ends_at_rest() -> None:
    eight = FigureOfEight(8.0, 14.0, 6.0)
    _consistent(eight.at, eight.duration_s)
    for time_s in (0.0, eight.duration_s, eight.duration_s + 5.0):
        here = eight.at(time_s)
        np.testing.assert_allclose(here.position_m, [0.0, 0.0, -6.0], atol=1e-9)
        np.testing.assert_allclose(here.velocity_mps, 0.0, atol=1e-9)
    fastest_mps = max(float(np.linalg.norm(eight.at(t).velocity_mps)) for t in np.linspace(0, eight.duration_s, 999))
    assert fastest_mps == pytest.approx(eight.peak_mps, rel=1e-3)


def test_way_points_are_reached_at_their_times() -> None:
    points = [WayPoint(10, 0, 10, 12.0), WayPoint(10, 10, 10, 20.0), WayPoint(10, 10, 10, 25.0)]
    trajectory = plan(points, take_off_m=10.0, land=False)
    for point in points:
        assert point.arrive_s is not None
        np.testing.assert_allclose(trajectory.at(point.arrive_s).position_m, [point.north_m, point.east_m, -10.0])
    assert trajectory.at(12.0 - 0.5).position_m[0] < 9.9


@pytest.mark.parametrize(
    ("point", "reason"),
    [
        (WayPoint(100, 0, 10, 12.0), r"way-point 1 cannot be reached at 12.0 s: 2\d.\d s at the earliest"),
        (WayPoint(0, 0, 60, 12.0), "at the earliest"),
        (WayPoint(0, 0, 10, 1.0), "at the earliest"),
        (WayPoint(0, 0, -1), "below the ground"),
        (WayPoint(math.nan, 0, 10), "not a place"),
    ],
)
def test_what_cannot_be_met_is_refused(point: WayPoint, reason: str) -> None:
    with pytest.raises(TrajectoryRefused, match=reason):
        plan([point], take_off_m=10.0)


def test_the_flight_of_an_eight_climbs_flies_it_and_lands_without_a_jump() -> None:
    flight = EightFlight(FigureOfEight(8.0, 14.0, 10.0))
    _consistent(flight.at, flight.duration_s)
    places = np.array([flight.at(t).position_m for t in np.arange(0.0, flight.duration_s, 0.05)])
    assert np.abs(np.diff(places, axis=0)).max() < 0.05 * 6.0
    assert places[:, 0].max() == pytest.approx(8.0, abs=0.1)
    assert places[:, 1].max() == pytest.approx(4.0, abs=0.1)
    assert places[:, 2].min() == pytest.approx(-10.0)
    np.testing.assert_allclose(places[0], np.zeros(3))
    assert places[-1, 2] > 0.5, "the ground ends the landing"


def test_take_off_needs_a_height_and_an_eight_a_speed_that_can_be_flown() -> None:
    with pytest.raises(TrajectoryRefused, match="take-off"):
        plan([], take_off_m=0.0)
    with pytest.raises(TrajectoryRefused, match="too fast"):
        FigureOfEight(20.0, 8.0, 6.0)
    with pytest.raises(TrajectoryRefused, match="above 0"):
        FigureOfEight(0.0, 8.0, 6.0)


def test_a_slanting_leg_keeps_both_limits() -> None:
    trajectory = Trajectory(np.zeros(3))
    trajectory.fly_to(WayPoint(30, 0, 30), LIMITS)
    speeds = [trajectory.at(t).velocity_mps for t in np.linspace(0, trajectory.duration_s, 200)]
    assert max(-speed[2] for speed in speeds) <= LIMITS.climb_mps + 1e-9
    assert max(abs(speed[0]) for speed in speeds) <= LIMITS.speed_mps + 1e-9


def test_a_landing_slows_down_before_the_ground() -> None:
    trajectory = plan([], take_off_m=10.0)
    low = [trajectory.at(t) for t in np.linspace(0, trajectory.duration_s, 2000) if t > 10.0]
    assert max(here.velocity_mps[2] for here in low) <= LIMITS.descent_mps + 1e-9
    near = [here.velocity_mps[2] for here in low if -1.5 < here.position_m[2] < 0.0]
    assert max(near) <= LIMITS.touchdown_mps + 1e-9
    assert trajectory.end_m[2] > 0.5, "the ground ends it"
