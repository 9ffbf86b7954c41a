"""The values that the rules read, from whole frames as pymavlink writes them."""

import math

import pytest

from server.alerts.core.kept_telemetry import GONE_S, KEPT, KeptTelemetry
from wire.dialect import build, mavlink
from wire.state_messages import state_key

GOOD_EKF = 1 | 2 | 4 | 8 | 16 | 32
GEOFENCE, AHRS = 1 << 20, 1 << 21


def battery(number: int = 0, charge: int = 0, percent: int = 50) -> object:
    return mavlink.MAVLink_battery_status_message(number, 0, 0, 0, [0] * 10, 0, 0, 0, percent, charge_state=charge)


def system(percent: int = 50, enabled: int = 0, health: int = 0) -> object:
    return mavlink.MAVLink_sys_status_message(enabled, enabled, health, 0, 12000, 0, percent, 0, 0, 0, 0, 0, 0)


def gps(fix: int) -> object:
    return mavlink.MAVLink_gps_raw_int_message(1, fix, 470000000, 80000000, 500000, 80, 80, 0, 0, 9)


def gps2(fix: int, satellites: int = 9) -> object:
    return mavlink.MAVLink_gps2_raw_message(1, fix, 470000000, 80000000, 500000, 80, 80, 0, 0, satellites, 0, 0)


def ekf(*variances: float, flags: int = GOOD_EKF) -> object:
    return mavlink.MAVLink_ekf_status_report_message(flags, *variances, 0.0)


def estimator(*ratios: float, flags: int = GOOD_EKF) -> object:
    return mavlink.MAVLink_estimator_status_message(1, flags, *ratios, 0.0, 0.0, 0.1, 0.1)


def vibration(*axes: float) -> object:
    return mavlink.MAVLink_vibration_message(1, *axes, 0, 0, 0)


def fence(status: int, kind: int) -> object:
    return mavlink.MAVLink_fence_status_message(status, 1, kind, 0)


PX4_SYSTEM = mavlink.MAV_SYS_STATUS_PREARM_CHECK


def heard(*messages: object) -> KeptTelemetry:
    telemetry = KeptTelemetry()
    for message in messages:
        frame = build(message, system_id=1, component_id=1, sequence=0)
        key = state_key(frame)
        assert key is not None and key[2] in KEPT
        telemetry.newest[key[2], key[3]] = frame
        telemetry.decode(0.0)
    return telemetry


@pytest.mark.parametrize(
    ("message", "name", "value"),
    [
        (system(37), "battery_percent", 37),
        (system(-1), "battery_percent", None),
        (system(0), "battery_percent", 0),
        (battery(charge=2), "battery_charge", 2),
        (battery(charge=7), "battery_charge", None),
        (battery(charge=0), "battery_charge", None),
        (gps(1), "gps_fix", 1),
        (gps(3), "gps_fix", 3),
        (ekf(0.1, 0.2, 0.3, 0.4), "estimator_fault", ""),
        (ekf(0.1, 0.9, 0.3, 0.4), "estimator_fault", "bad position"),
        (ekf(0.1, 0.2, 0.3, 0.8), "estimator_fault", "bad compass"),
        (ekf(0.1, 0.2, 0.3, 0.4, flags=0), "estimator_fault", "no attitude or height"),
        (estimator(0.1, 0.2, 0.3, 0.4), "estimator_fault", ""),
        (estimator(0.1, 0.2, 1.3, 0.4), "estimator_fault", "bad height"),
        (vibration(3.0, 61.0, 5.0), "vibration_m_s2", 61.0),
        (fence(0, 0), "fence_breach", ""),
        (fence(1, 2), "fence_breach", "its maximum height"),
        (fence(1, 3), "fence_breach", "its boundary"),
        (system(50, enabled=AHRS, health=0), "estimator_fault", "not healthy"),
        (system(50, enabled=GEOFENCE, health=GEOFENCE), "fence_breach", ""),
        (system(50, enabled=GEOFENCE, health=0), "fence_breach", "its fence"),
        (system(50), "estimator_fault", None),
    ],
)
def test_one_message(message: object, name: str, value: object) -> None:
    assert getattr(heard(message), name) == value


def test_the_worst_battery_counts_and_a_better_one_does_not_hide_it() -> None:
    assert heard(battery(0, 1), battery(1, 3)).battery_charge == 3
    assert heard(battery(0, 1), battery(1, 3), battery(0, 2)).battery_charge == 3
    assert heard(battery(0, 1), battery(1, 3), battery(1, 1)).battery_charge == 1


def test_the_worst_battery_is_told_with_its_own_numbers() -> None:
    two = heard(system(80), battery(0, 1, 80), battery(1, 3, 12))
    assert (two.battery_number, two.battery_charge, two.battery_percent) == (2, 3, 12)
    emptier = heard(battery(0, 0, 20), battery(1, 0, 60))
    assert (emptier.battery_number, emptier.battery_percent) == (1, 20)
    one = heard(system(80), battery(0, 1, -1))
    assert (one.battery_number, one.battery_charge, one.battery_percent) == (None, 1, 80)


def test_the_worst_gps_is_told_with_its_own_numbers() -> None:
    one = heard(gps(3))
    assert (one.gps_number, one.gps_fix, one.satellites, one.gps_lost) == (None, 3, 9, False)
    second_lost = heard(gps(3), gps2(1, 4))
    assert (second_lost.gps_number, second_lost.gps_fix, second_lost.satellites) == (2, 1, 4)
    assert second_lost.gps_lost is False, "it flies on the other"
    fewer = heard(gps2(3, 14), gps(3))
    assert (fewer.gps_number, fewer.satellites) == (1, 9)
    assert heard(gps(1), gps2(0)).gps_lost is True


def test_a_gps_that_reports_no_more_is_gone() -> None:
    telemetry = heard(gps(3), gps2(1))
    for at in (20.0, 40.0, 61.0):
        telemetry.newest[24, 0] = build(gps(4), system_id=1, component_id=1, sequence=int(at))  # type: ignore[arg-type]
        telemetry.decode(at)
    assert (telemetry.gps_number, telemetry.gps_fix, telemetry.gps_lost) == (None, 4, False)
    telemetry.decode(200.0)
    assert (telemetry.gps_fix, telemetry.satellites, telemetry.gps_lost) == (None, None, None)


def test_sensors_that_are_enabled_and_ill_are_named() -> None:
    mag, gyro, laser = 4, 1, 256
    assert heard(system()).sensor_fault == ""
    assert heard(system(enabled=mag | gyro, health=mag | gyro)).sensor_fault == ""
    assert heard(system(enabled=gyro, health=gyro)).sensor_fault == "", "a compass that is switched off is none"
    assert heard(system(enabled=mag | gyro | laser, health=0)).sensor_fault == "its gyroscope and its compass"


def test_a_battery_that_reports_no_more_is_gone() -> None:
    telemetry = heard(battery(0, 1, 80), battery(1, 3, 12))
    for at in (20.0, 40.0, GONE_S + 1.0):
        frame = build(battery(0, 1, 79), system_id=1, component_id=1, sequence=int(at))
        telemetry.newest[147, 0] = frame
        telemetry.decode(at)
    assert (telemetry.battery_number, telemetry.battery_charge, telemetry.battery_percent) == (None, 1, 79)


def test_a_report_of_its_own_counts_more_than_the_summary() -> None:
    bad = system(50, enabled=AHRS | GEOFENCE, health=0)
    telemetry = heard(ekf(0.1, 0.1, 0.1, 0.1), fence(0, 0), bad)
    assert (telemetry.estimator_fault, telemetry.fence_breach) == ("", "")


def test_hostile_values_are_survived() -> None:
    assert heard(ekf(math.nan, math.nan, math.nan, math.nan)).estimator_fault == ""
    assert heard(vibration(math.inf, math.nan, 7.0)).vibration_m_s2 == 7.0
    assert heard(vibration(math.inf, math.nan, math.nan)).vibration_m_s2 is None
    assert heard(ekf(math.nan, math.inf, 0.0, 0.0)).estimator_fault == "bad position"
    for number in range(256):
        telemetry = heard(battery(number, 3))
    assert telemetry.battery_charge == 3


def test_nothing_is_known_of_a_new_link() -> None:
    telemetry = heard(system(5), battery(charge=3), gps(0), ekf(1.0, 1.0, 1.0, 1.0), vibration(99, 0, 0), fence(1, 1))
    telemetry.forget()
    telemetry.decode(0.0)
    values = [telemetry.battery_percent, telemetry.battery_charge, telemetry.gps_fix, telemetry.estimator_fault]
    assert [*values, telemetry.vibration_m_s2, telemetry.fence_breach] == [None] * 6


def test_px4_tells_by_health_alone_whether_it_would_arm() -> None:
    for autopilot, health, expected in ((12, PX4_SYSTEM, True), (12, 0, False), (3, PX4_SYSTEM, None)):
        telemetry = KeptTelemetry()
        telemetry.autopilot = autopilot
        frame = build(system(health=health), system_id=1, component_id=1, sequence=0)
        telemetry.newest[1, 0] = frame
        telemetry.decode(0.0)
        assert telemetry.arming_ok is expected
