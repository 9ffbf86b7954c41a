"""The safe-command step: which directions are refused, what is bounded, and that nothing leads beyond the limits."""

from __future__ import annotations

from math import hypot, inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard_agent.autonomy.controller import Direction, GoBy, GoTo, Hold, Land, Move, Turn, forward, left, up
from onboard_agent.autonomy.core.course import EVERY_S, Course, Place, Velocity
from onboard_agent.autonomy.core.local_plane import LocalPlane
from onboard_agent.autonomy.core.safe_commands import (
    MAX_CLIMB_M_S,
    MAX_DESCENT_M_S,
    MAX_MOVE_S,
    MAX_TURN_DEG_S,
    MAX_WITHIN_S,
    Limits,
    Motion,
    MoveGoal,
    PlaceGoal,
    judge,
    within,
)

LIMITS = Limits(max_speed_m_s=5.0, min_height_m=2.0, max_height_m=30.0, max_distance_m=100.0)
PLANE = LocalPlane(47.0, 8.0)
HERE = Motion(10.0, 0.0, 10.0, 0.0, 0.0, 0.0, heading_deg=90.0, at=50.0)
NOW = 50.0


def test_relative_places_follow_the_nose() -> None:
    goal = judge(GoBy(forward_m=5, right_m=2, up_m=1), HERE, PLANE, LIMITS, NOW).goal
    assert isinstance(goal, PlaceGoal)
    assert (goal.north_m, goal.east_m, goal.height_m) == pytest.approx((8.0, 5.0, 11.0))


def test_places_on_the_map_are_metres_from_the_start() -> None:
    there = PLANE.on_map(-30.0, 40.0)
    goal = judge(GoTo(*there, 20.0), HERE, PLANE, LIMITS, NOW).goal
    assert isinstance(goal, PlaceGoal)
    assert (goal.north_m, goal.east_m) == pytest.approx((-30.0, 40.0), abs=0.01)


def test_the_plane_crosses_the_antimeridian() -> None:
    plane = LocalPlane(-17.0, 179.9999)
    lat, lon = plane.on_map(0.0, 50.0)
    assert lon < 0
    assert plane.local(lat, lon) == pytest.approx((0.0, 50.0), abs=0.01)


@pytest.mark.parametrize(
    ("direction", "words"),
    [
        (GoBy(forward_m=200), "from the start"),
        (GoBy(up_m=21), "above home"),
        (GoBy(up_m=-9), "above home"),
        (GoTo(47.0, 8.1, 10.0), "from the start"),
        (GoTo(91.0, 8.0, 10.0), "no such place"),
        (GoBy(forward_m=5, speed_m_s=0), "no speed"),
        (GoBy(forward_m=5, within_s=-1), "no time"),
        (Move(forward_m_s=nan), "not finite"),
        (Move(up_m_s=inf), "not finite"),
        (Turn(nan), "not finite"),
        (GoTo(nan, 8.0, 10.0), "not finite"),
        (forward(1.0, for_s=0), "no time"),
        (Land(), "no direction for set-points"),
    ],
)
def test_what_is_refused_and_why(direction: Direction, words: str) -> None:
    judged = judge(direction, HERE, PLANE, LIMITS, NOW)
    assert judged.goal is None
    assert words in judged.words


def test_speeds_and_times_are_bounded_and_it_is_said() -> None:
    judged = judge(Move(30.0, 40.0, 9.0, 200.0, for_s=60.0), HERE, PLANE, LIMITS, NOW)
    assert judged.goal == MoveGoal(3.0, 4.0, MAX_CLIMB_M_S, MAX_TURN_DEG_S, NOW + MAX_MOVE_S)
    assert judged.bounded
    down = judge(up(-9.0), HERE, PLANE, LIMITS, NOW).goal
    assert isinstance(down, MoveGoal)
    assert down.up_m_s == -MAX_DESCENT_M_S
    place = judge(GoBy(forward_m=5, speed_m_s=50, within_s=9999), HERE, PLANE, LIMITS, NOW)
    assert isinstance(place.goal, PlaceGoal)
    assert (place.goal.speed_m_s, place.goal.until, place.bounded) == (5.0, NOW + MAX_WITHIN_S, True)
    gentle = judge(left(2.0), HERE, PLANE, LIMITS, NOW)
    assert not gentle.bounded
    assert isinstance(gentle.goal, MoveGoal)
    assert gentle.goal.right_m_s == -2.0


speeds = st.floats(-100, 100)


@given(speeds, speeds, speeds, st.floats(-150, 150), st.floats(-150, 150), st.floats(-5, 60))
def test_no_velocity_leads_beyond_the_limits(
    vn: float, ve: float, vu: float, north: float, east: float, height: float
) -> None:
    motion = Motion(north, east, height, 0.0, 0.0, 0.0, 0.0, NOW)
    n, e, u = within((vn, ve, vu), motion, LIMITS)
    assert hypot(n, e) <= LIMITS.max_speed_m_s + 1e-6
    assert -MAX_DESCENT_M_S <= u <= MAX_CLIMB_M_S
    away = hypot(north, east)
    if away >= LIMITS.max_distance_m:
        assert n * north + e * east <= 1e-6 * away, "outward"
    assert height < LIMITS.max_height_m or u <= 0
    assert height > LIMITS.min_height_m or u >= 0


@given(st.lists(st.tuples(speeds, speeds, speeds, st.floats(-90, 90)), min_size=1, max_size=20))
def test_a_perfect_drone_stays_within_whatever_it_is_told(moves: list[tuple[float, float, float, float]]) -> None:
    """20 moves of 5 s each: enough to fly 500 m."""
    north, east, height, now = 0.0, 0.0, 10.0, NOW
    course = Course(LIMITS, 0.0)
    for move in moves:
        motion = Motion(north, east, height, 0.0, 0.0, 0.0, course.heading_deg, now)
        goal = judge(Move(*move, for_s=5.0), motion, PLANE, LIMITS, now).goal
        assert goal is not None
        course.fly(goal)
        for _ in range(100):
            now += EVERY_S
            setpoint = course.setpoint(Motion(north, east, height, 0.0, 0.0, 0.0, course.heading_deg, now), now)
            assert isinstance(setpoint, Velocity)
            north, east = north + setpoint.north_m_s * EVERY_S, east + setpoint.east_m_s * EVERY_S
            height += setpoint.up_m_s * EVERY_S
            assert hypot(north, east) <= LIMITS.max_distance_m + 0.3
            assert LIMITS.min_height_m - 0.01 <= height <= LIMITS.max_height_m + 0.01


def test_a_hold_stops_first_and_keeps_the_place_where_it_came_to_rest() -> None:
    course = Course(LIMITS, 30.0)
    goal = judge(Hold(), HERE, PLANE, LIMITS, NOW).goal
    assert goal is not None
    course.fly(goal)
    moving = Motion(10.0, 0.0, 10.0, 3.0, 0.0, 0.0, 30.0, NOW)
    assert course.setpoint(moving, NOW) == Velocity(0.0, 0.0, 0.0, 30.0)
    still = Motion(12.0, 0.5, 10.2, 0.1, 0.0, 0.0, 30.0, NOW)
    assert course.setpoint(still, NOW) == Place(12.0, 0.5, 10.2, 30.0)
    drifted = Motion(12.4, 0.5, 10.2, 0.5, 0.0, 0.0, 30.0, NOW)
    assert course.setpoint(drifted, NOW) == Place(12.0, 0.5, 10.2, 30.0)


def test_an_old_position_is_no_ground_to_move_on() -> None:
    course = Course(LIMITS, 0.0)
    goal = judge(forward(5.0, for_s=5.0), HERE, PLANE, LIMITS, NOW).goal
    assert goal is not None
    course.fly(goal)
    assert course.setpoint(HERE, NOW + 0.5) != Velocity(0.0, 0.0, 0.0, 0.0)
    assert course.setpoint(HERE, NOW + 1.1) == Velocity(0.0, 0.0, 0.0, 0.0)


def test_the_nose_turns_at_a_bounded_rate_the_short_way() -> None:
    course = Course(LIMITS, 350.0)
    goal = judge(Turn(30.0), Motion(0, 0, 10, 0, 0, 0, 350.0, NOW), PLANE, LIMITS, NOW).goal
    assert goal is not None
    course.fly(goal)
    headings = [course.setpoint(Motion(0, 0, 10, 0, 0, 0, 350.0, NOW), NOW).heading_deg for _ in range(20)]
    assert headings[0] == pytest.approx(350.0 + MAX_TURN_DEG_S * EVERY_S)
    assert headings[-1] == pytest.approx(20.0)
