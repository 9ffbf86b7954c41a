"""Sensors err as their figures say: bias, noise, rate, delay, faults; and a calibration takes the iron away."""

from __future__ import annotations

import numpy as np
import pytest

from simulator.physics.rotation import Floats, from_euler, level, matrix
from simulator.sensors.barometer import Barometer
from simulator.sensors.cells import Batteries
from simulator.sensors.inertial import ACCELEROMETER, GYROSCOPE, Inertial
from simulator.sensors.magnetometer import NOISE_GAUSS, Magnetometer, earth_field_gauss
from simulator.sensors.magnetometer_calibration import CalibrationRefused, MagnetometerCalibration, fit
from simulator.sensors.satellites import DELAY_S, RATE_HZ, Fix, GpsReceiver

DT_S = 0.005
MANY = 300


def source(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("errors", [ACCELEROMETER, GYROSCOPE])
def test_inertial_bias_and_noise_are_as_specified(errors: object) -> None:
    sensor = Inertial(errors, MANY, source())  # type: ignore[arg-type]
    truth, hover = np.zeros((3, MANY)), np.ones(MANY)
    reads = np.array([sensor.read(truth, hover, DT_S) for _ in range(200)])
    assert reads.mean(axis=0).std() == pytest.approx(sensor.errors.bias, rel=0.1)
    wanted = np.hypot(sensor.errors.vibration, sensor.errors.noise / np.sqrt(2.0 * DT_S))
    assert reads.std(axis=0).mean() == pytest.approx(wanted, rel=0.05)
    sensor.noise_factor[0] = 20.0
    reads = np.array([sensor.read(truth, hover, DT_S) for _ in range(200)])
    assert reads[:, :, 0].std() > 10.0 * reads[:, :, 1].std(axis=0).mean()
    assert np.abs(sensor.read(np.full((3, MANY), 1e6), hover, DT_S)).max() == errors.limit  # type: ignore[attr-defined]


def test_gps_comes_at_its_rate_and_late() -> None:
    gps = GpsReceiver(MANY, source(), warm_start=True)
    moving = np.zeros((3, MANY))
    moving[0] = 10.0
    seen: list[tuple[float, float]] = []
    errors: list[Floats] = []
    for i in range(round(4.0 / DT_S)):
        now_s = i * DT_S
        reading = gps.step(moving * now_s, moving, now_s)
        if reading is not None:
            seen.append((now_s, reading.taken_s))
            errors.append(reading.value[:3] - moving * reading.taken_s)
    assert len(seen) == pytest.approx(4.0 * RATE_HZ, abs=1.1)
    assert all(now_s - taken_s == pytest.approx(DELAY_S, abs=DT_S) for now_s, taken_s in seen)
    assert np.array(errors)[:, 0].std() == pytest.approx(1.30, rel=0.15)
    assert np.array(errors)[:, 2].std() == pytest.approx(2.57, rel=0.15)


def test_half_of_the_fixes_are_within_the_data_sheets_circle_and_a_minute_moves_them_little() -> None:
    """1.5 m CEP. Within a minute the error of most changes by less than half of that."""
    gps, still = GpsReceiver(2000, source(), warm_start=True), np.zeros((3, 2000))
    fixes = [r.value[:2] for i in range(301) if (r := gps.step(still, still, i / RATE_HZ)) is not None]
    assert np.median(np.hypot(*fixes[0])) == pytest.approx(1.53, rel=0.08)
    moved_m = np.hypot(*(fixes[-1] - fixes[0]))
    assert 0.3 < np.median(moved_m) < 0.75


def test_gps_finds_its_fix_in_steps_and_loses_it() -> None:
    gps, still = GpsReceiver(2, source()), np.zeros((3, 2))
    states: list[tuple[int, int]] = []
    for i in range(round(20.0 / DT_S)):
        now_s = i * DT_S
        gps.lost[1] = 10.0 <= now_s < 14.0
        gps.step(still, still, now_s)
        state = (int(gps.fix[0]), int(gps.fix[1]))
        if not states or states[-1] != state:
            states.append(state)
    assert states == [
        (Fix.NO_FIX, Fix.NO_FIX),
        (Fix.FIX_2D, Fix.FIX_2D),
        (Fix.FIX_3D, Fix.FIX_3D),
        (Fix.FIX_3D, Fix.NO_FIX),
        (Fix.FIX_3D, Fix.FIX_2D),
        (Fix.FIX_3D, Fix.FIX_3D),
    ]
    gps.present[0] = False
    gps.step(still, still, 21.0)
    assert gps.fix[0] == Fix.NO_GPS
    assert gps.status().in_use.tolist() == [0, 14]


def test_a_gps_jump_moves_one_vehicle_only() -> None:
    gps, still = GpsReceiver(2, source(), warm_start=True), np.zeros((3, 2))
    gps.jump_m[0, 0] = 50.0
    reading = next(r for i in range(100) if (r := gps.step(still, still, i * DT_S)) is not None)
    assert reading.value[0, 0] > 45.0
    assert abs(reading.value[0, 1]) < 5.0


def test_a_warm_barometer_is_compensated_and_a_stuck_one_repeats_itself() -> None:
    plain, compensated = Barometer(MANY, source()), Barometer(MANY, source())
    plain.compensated[:] = False
    height = np.full(MANY, 20.0)
    spread = {}
    for name, sensor in (("plain", plain), ("compensated", compensated)):
        reads = [r.value for i in range(1000) if (r := sensor.step(height, 600.0 + i * 0.04)) is not None]
        spread[name] = float(np.mean(reads, axis=0).std())
    assert spread["plain"] > 0.7
    assert spread["compensated"] < 0.25
    compensated.stuck[0] = True
    reads = [r.value for i in range(50) if (r := compensated.step(height + i, 700.0 + i * 0.04)) is not None]
    assert np.ptp(np.array(reads)[:, 0]) == 0.0
    assert np.ptp(np.array(reads)[:, 1]) > 40.0


def test_a_battery_sags_under_load_recovers_and_empties() -> None:
    batteries = Batteries(2, source())
    batteries.extra_resistance_ohm[1] = 0.15
    for _ in range(2000):
        batteries.step(np.ones(2), DT_S)
    loaded = batteries.voltage_v.copy()
    assert loaded[1] < loaded[0] - 2.0
    assert batteries.power[1] < batteries.power[0]
    for _ in range(2000):
        batteries.step(np.zeros(2), DT_S)
    assert batteries.voltage_v[0] > loaded[0] + 0.3
    batteries.used_mah[:] = batteries.capacity_mah
    batteries.step(np.ones(2), DT_S)
    assert batteries.power.tolist() == [0.0, 0.0]


def turned_in_flight(sensor: Magnetometer, lean_rad: float = 0.45, full_turn: bool = True) -> tuple[Floats, Floats]:
    """Samples of a flown calibration: two turns, leaning in all directions; the heading is off by 2 rad."""
    count = sensor.present.size
    samples, attitudes = [], []
    for i in range(400):
        turn = i / 400.0
        yaw = np.full(count, 4.0 * np.pi * turn if full_turn else 0.3 * turn)
        roll = np.full(count, lean_rad * np.sin(14.0 * np.pi * turn))
        pitch = np.full(count, lean_rad * np.cos(10.0 * np.pi * turn))
        attitude = from_euler(roll, pitch, yaw)
        attitudes.append(from_euler(roll, pitch, yaw + 2.0))
        samples.append(sensor.raw_gauss(matrix(attitude)))
    return np.stack(samples, axis=2), np.stack(attitudes, axis=2)


def heading_error_rad(sensor: Magnetometer) -> Floats:
    worst = np.zeros(sensor.present.size)
    for yaw in np.linspace(-3.0, 3.0, 13):
        field = sensor.calibration.corrected(sensor.raw_gauss(matrix(level(worst.size, yaw))))
        heading = np.arctan2(-field[1], field[0]) + np.radians(3.0)
        worst = np.maximum(worst, np.abs(np.angle(np.exp(1j * (heading - yaw)))))
    return worst


def test_a_flown_calibration_takes_the_iron_away_and_survives_its_file() -> None:
    sensor = Magnetometer(40, source(5))
    before = heading_error_rad(sensor)
    sensor.calibration = fit(*turned_in_flight(sensor), earth_field_gauss())
    after = heading_error_rad(sensor)
    assert np.degrees(np.median(before)) > 15.0
    assert np.degrees(np.max(after)) < 6.0
    assert np.abs(sensor.calibration.offset_gauss - sensor.hard_iron_gauss).max() < 0.03
    loaded = MagnetometerCalibration.from_json(sensor.calibration.to_json())
    np.testing.assert_array_equal(loaded.offset_gauss, sensor.calibration.offset_gauss)
    np.testing.assert_array_equal(loaded.scale, sensor.calibration.scale)


def test_a_calibration_is_refused_without_a_full_turn_or_with_too_few_samples() -> None:
    sensor = Magnetometer(1, source())
    with pytest.raises(CalibrationRefused, match="turned too little"):
        fit(*turned_in_flight(sensor, full_turn=False), earth_field_gauss())
    samples, attitudes = turned_in_flight(sensor)
    with pytest.raises(CalibrationRefused, match="50 samples"):
        fit(samples[:, :, :50], attitudes, earth_field_gauss())
    wild = samples + source().normal(0.0, 0.1, (3, 1, 400))
    with pytest.raises(CalibrationRefused, match="do not follow"):
        fit(wild, attitudes, earth_field_gauss())


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"offset_gauss": [[1,2]], "scale": [[1,1]]}', "nonsense"])
def test_a_damaged_calibration_is_refused(text: str) -> None:
    with pytest.raises(CalibrationRefused):
        MagnetometerCalibration.from_json(text)


def test_the_magnetometer_reads_the_earths_field() -> None:
    sensor = Magnetometer(1, source())
    sensor.hard_iron_gauss[:], sensor.soft_iron[:] = 0.0, 1.0
    reads = np.array([sensor.raw_gauss(matrix(level(1, 0.0))) for _ in range(200)])
    np.testing.assert_allclose(reads.mean(axis=0), earth_field_gauss(), atol=4.0 * NOISE_GAUSS / np.sqrt(200))
