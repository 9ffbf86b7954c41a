"""The motion of the vehicle, and the battery charge that it needs for the way home."""

import pytest

from onboard_agent.autopilot.motion import ESTIMATE_FRESH_S, FRESH_S, LEVEL_WITHIN_DEG, NEAR_GROUND_M, Motion
from onboard_agent.failsafe.way_home import RESERVE_PERCENT, WayHome
from wire.dialect import mavlink

GOOD, LOST, UNAIDED = 0x33F, 0x025, 0x0A7
"""Flags of EKF_STATUS_REPORT: with satellites, some seconds after their loss, and some more seconds later."""


def attitude(roll_deg: float, pitch_deg: float) -> mavlink.MAVLink_attitude_message:
    return mavlink.MAVLink_attitude_message(0, roll_deg / 57.29578, pitch_deg / 57.29578, 0, 0, 0, 0)


def position(height_m: float, climb_m_s: float, *, speed_m_s: float = 0.0, lat_deg: float = 47.0) -> object:
    moves = int(speed_m_s * 100), 0, int(-climb_m_s * 100)
    return mavlink.MAVLink_global_position_int_message(0, int(lat_deg * 1e7), 0, 0, int(height_m * 1000), *moves, 0)


def estimator(flags: int) -> mavlink.MAVLink_ekf_status_report_message:
    return mavlink.MAVLink_ekf_status_report_message(flags, 0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("roll_deg", "pitch_deg", "level"),
    [(0, 0, True), (-11, 5, True), (0, LEVEL_WITHIN_DEG + 1, False), (-30, 0, False)],
)
def test_level_is_both_axes_and_fresh(roll_deg: float, pitch_deg: float, level: bool) -> None:
    motion = Motion()
    assert motion.level(10.0) is None
    motion.attitude(attitude(roll_deg, pitch_deg), 10.0)
    assert motion.level(10.0 + FRESH_S) is level
    assert motion.level(10.1 + FRESH_S) is None


@pytest.mark.parametrize(("flags", "knows"), [(GOOD, True), (LOST, False), (UNAIDED, False), (GOOD | 0x80, False)])
def test_the_estimators_flags_tell_whether_it_knows_its_place(flags: int, knows: bool) -> None:
    motion = Motion()
    assert motion.has_position(10.0) is None
    motion.estimator(estimator(flags), 10.0)
    assert motion.has_position(10.0 + ESTIMATE_FRESH_S) is knows
    assert motion.has_position(10.1 + ESTIMATE_FRESH_S) is None


@pytest.mark.parametrize(
    ("height_m", "climb_m_s", "sinking", "low"),
    [
        (3.0, -2.5, True, True),
        (NEAR_GROUND_M + 1, -2.5, True, False),
        (3.0, -0.5, False, False),  # the last metres of a landing
        (3.0, 0.0, False, False),
        (3.0, 2.5, False, False),
    ],
)
def test_low_and_sinking(height_m: float, climb_m_s: float, sinking: bool, low: bool) -> None:
    motion = Motion()
    motion.global_position(position(height_m, climb_m_s, speed_m_s=3.0), 10.0)
    assert (motion.sinking(10.0), motion.low_and_sinking(10.0)) == (sinking, low)
    assert motion.speed_m_s == 3.0
    assert not motion.sinking(10.1 + FRESH_S), "nothing fresh says so"


def test_the_way_home_is_known_where_both_ends_are() -> None:
    motion = Motion()
    motion.global_position(position(20.0, 0.0, lat_deg=47.001), 10.0)
    assert motion.home_m is None
    zeros = [0.0] * 9
    motion.home_position(mavlink.MAVLink_home_position_message(470_000_000, 0, 0, *zeros[:3], zeros[:4], *zeros[:3]))
    assert motion.home_m == pytest.approx(111.3, abs=0.5)


@pytest.mark.parametrize(("said", "percent"), [(80, 80.0), (0, 0.0), (-1, None)])
def test_a_battery_that_is_not_told_is_none(said: int, percent: float | None) -> None:
    motion = Motion()
    motion.battery(mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 0, 0, said, 0, 0, 0, 0, 0, 0))
    assert motion.battery_percent == percent


def test_the_battery_is_due_at_what_the_way_home_needs() -> None:
    way = WayHome()
    near, far = (way.needed_percent(home_m=home_m, alt_rel_m=20.0) for home_m in (0.0, 1000.0))
    assert RESERVE_PERCENT < near < far
    assert not way.due(percent=far + 1.0, home_m=1000.0, alt_rel_m=20.0)
    assert way.due(percent=far, home_m=1000.0, alt_rel_m=20.0)
    assert way.due(percent=near - 1.0, home_m=None, alt_rel_m=20.0), "home not known: the reserve and the way down"
    assert not way.due(percent=None, home_m=1000.0, alt_rel_m=20.0)


def test_what_this_flight_uses_is_learnt_and_forgotten_on_the_ground() -> None:
    way = WayHome()
    usual = way.needed_percent(home_m=500.0, alt_rel_m=20.0)
    for second in range(100):
        way.seen(float(second), airborne=True, percent=100.0 - second // 2)
    thirsty = way.needed_percent(home_m=500.0, alt_rel_m=20.0)
    assert thirsty > usual * 1.5
    way.seen(100.0, airborne=False, percent=50.0)
    way.seen(101.0, airborne=True, percent=100.0)
    assert way.needed_percent(home_m=500.0, alt_rel_m=20.0) == usual


def test_a_battery_that_was_changed_begins_anew_and_one_that_lasts_is_not_trusted_too_far() -> None:
    way = WayHome()
    usual = way.needed_percent(home_m=500.0, alt_rel_m=20.0)
    for second in range(5000):
        way.seen(float(second), airborne=True, percent=100.0 - second // 500)
    assert RESERVE_PERCENT < way.needed_percent(home_m=500.0, alt_rel_m=20.0) < usual
