"""The physics of a quadrotor hold the laws: fall, hover, terminal speed, energy, ground effect."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds.tiers import examples

from simulator.physics.frames import Frame
from simulator.physics.mixer import IDLE_SHARE, Mixer
from simulator.physics.moving_air import MovingAir
from simulator.physics.quadrotor import Quadrotors
from simulator.physics.quadrotor_design import QuadrotorDesign
from simulator.physics.rigid_body import GRAVITY_MSS
from simulator.physics.rotation import from_euler, from_vector, matrix, to_euler, to_vector

DESIGN = QuadrotorDesign()
VACUUM = replace(DESIGN, drag_area_m2=0.0, rotor_drag=0.0, turning_drag_nms=(0.0, 0.0, 0.0), ground_effect=False)
STILL = np.zeros((3, 1))
OFF = np.zeros((4, 1))
DT_S = 0.005


def dropped(design: QuadrotorDesign, from_m: float, count: int = 1) -> Quadrotors:
    body = Quadrotors(design, count)
    body.position_m[2] = -from_m
    body.on_ground[:] = False
    return body


def test_the_dimensions_give_the_mass_and_the_inertia() -> None:
    """By hand: a box and, at each end of an arm, a motor and a third of the arm."""
    at_end_kg = 0.067 + 0.02
    side_m = 0.25 / math.sqrt(2.0)
    assert DESIGN.mass_kg == pytest.approx(1.5)
    assert DESIGN.inertia_kgm2[0] == pytest.approx(0.992 / 12 * (0.12**2 + 0.1**2) + 4 * at_end_kg * side_m**2)
    assert DESIGN.inertia_kgm2[2] == pytest.approx(0.992 / 12 * (0.18**2 + 0.12**2) + 4 * at_end_kg * 0.25**2)
    assert 2.0 < 4 * DESIGN.full_thrust_n / DESIGN.weight_n < 2.5


@given(fall_s=st.floats(0.1, 4.0), tilt=st.floats(-3.0, 3.0))
@settings(max_examples=examples(8, long=50), deadline=None)
def test_a_fall_in_a_vacuum_follows_gravity_and_keeps_its_energy(fall_s: float, tilt: float) -> None:
    body = dropped(VACUUM, 200.0)
    body.attitude = from_euler(np.array([tilt]), np.array([0.3]), np.array([1.0]))
    body.rates_rps = np.array([[1.0], [-2.0], [0.5]])
    before_j = body.energy_j()[0]
    steps = round(fall_s / DT_S)
    for _ in range(steps):
        body.step(OFF, DT_S, STILL)
    assert 200.0 - body.alt_m[0] == pytest.approx(0.5 * GRAVITY_MSS * (steps * DT_S) ** 2, rel=1e-9)
    assert body.energy_j()[0] == pytest.approx(before_j, rel=1e-6)
    assert np.abs(body.specific_force_mss).max() < 1e-9, "an accelerometer in free fall reads nothing"


def test_a_fall_in_air_ends_at_the_terminal_speed() -> None:
    body = dropped(DESIGN, 500.0)
    for _ in range(round(12.0 / DT_S)):
        body.step(OFF, DT_S, STILL)
    assert body.velocity_mps[2, 0] == pytest.approx(DESIGN.terminal_mps, rel=1e-3)
    assert not body.on_ground[0]


@given(
    speed=st.tuples(*[st.floats(-15.0, 15.0)] * 3),
    rates=st.tuples(*[st.floats(-6.0, 6.0)] * 3),
)
@settings(max_examples=examples(8, long=50), deadline=None)
def test_without_motors_and_wind_energy_is_only_lost(
    speed: tuple[float, float, float], rates: tuple[float, float, float]
) -> None:
    body = dropped(DESIGN, 100.0)
    body.velocity_mps[:, 0], body.rates_rps[:, 0] = speed, rates
    last_j = body.energy_j()[0]
    for _ in range(300):
        body.step(OFF, DT_S, STILL)
        now_j = body.energy_j()[0]
        assert now_j <= last_j * (1.0 + 1e-9)
        last_j = now_j


@pytest.mark.parametrize("frame", Frame)
def test_the_weight_hovers(frame: Frame) -> None:
    design = replace(DESIGN, frame=frame, ground_effect=False)
    body = dropped(design, 10.0)
    command = Mixer(design).commands(np.array([design.weight_n]), np.zeros((3, 1)))
    body.rotor_rps[:] = design.hover_speed_rps
    for _ in range(400):
        body.step(command, DT_S, STILL)
    assert body.thrust_n.sum() == pytest.approx(design.weight_n, rel=1e-6)
    assert body.alt_m[0] == pytest.approx(10.0, abs=1e-3)
    assert np.abs(body.rates_rps).max() < 1e-9


def test_the_ground_lifts() -> None:
    """At hover power a vehicle just above the ground climbs; ten rotor radii up it does not."""
    speed = np.full((4, 1), DESIGN.hover_speed_rps / DESIGN.full_speed_rps)
    low, high = dropped(DESIGN, 0.03), dropped(DESIGN, 10.0)
    for body in (low, high):
        body.rotor_rps[:] = DESIGN.hover_speed_rps
        for _ in range(100):
            body.step(speed, DT_S, STILL)
    assert low.alt_m[0] > 0.04
    assert high.alt_m[0] == pytest.approx(10.0, abs=0.01)


def test_a_motor_follows_its_command_with_its_lag() -> None:
    body = Quadrotors(DESIGN)
    for _ in range(round(DESIGN.motor_lag_s / DT_S)):
        body.step(np.ones((4, 1)), DT_S, STILL)
    assert body.rotor_rps[0, 0] == pytest.approx(DESIGN.full_speed_rps * (1.0 - math.exp(-1.0)), rel=1e-6)


def test_wind_carries_a_vehicle_along_until_it_moves_with_the_air() -> None:
    body = dropped(replace(DESIGN, ground_effect=False), 50.0)
    wind = np.array([[5.0], [0.0], [0.0]])
    body.rotor_rps[:] = DESIGN.hover_speed_rps
    for _ in range(round(30.0 / DT_S)):
        body.step(np.full((4, 1), DESIGN.hover_speed_rps / DESIGN.full_speed_rps), DT_S, wind)
    assert body.velocity_mps[0, 0] == pytest.approx(5.0, rel=0.02)


def test_a_vehicle_among_many_flies_as_it_would_alone() -> None:
    commands = np.random.default_rng(3).uniform(0.5, 0.8, (4, 7))
    many = dropped(DESIGN, 20.0, 7)
    for _ in range(200):
        many.step(commands, DT_S, np.zeros((3, 7)))
    for i in (0, 6):
        alone = dropped(DESIGN, 20.0)
        for _ in range(200):
            alone.step(commands[:, i : i + 1], DT_S, STILL)
        np.testing.assert_allclose(alone.position_m[:, 0], many.position_m[:, i], rtol=1e-12)
        np.testing.assert_allclose(alone.attitude[:, 0], many.attitude[:, i], rtol=1e-12)


def test_a_leaning_touchdown_is_felt_by_the_gyroscope() -> None:
    """What the sensors do not feel, no filter can follow."""
    body = dropped(DESIGN, 0.05)
    body.attitude = from_euler(np.array([0.3]), np.array([0.0]), np.array([0.0]))
    turned_rad = 0.0
    for _ in range(200):
        body.step(OFF, DT_S, STILL)
        turned_rad += body.rates_rps[0, 0] * DT_S
    assert turned_rad == pytest.approx(-0.3, abs=0.03)
    assert abs(to_euler(body.attitude)[0, 0]) < 0.01


def test_on_the_ground_it_stands_level_and_reads_gravity() -> None:
    body = dropped(DESIGN, 1.0)
    body.velocity_mps[0] = 2.0
    body.attitude = from_euler(np.array([0.2]), np.array([-0.1]), np.array([2.0]))
    hit_mps = 0.0
    for _ in range(800):
        body.step(OFF, DT_S, STILL)
        hit_mps = max(hit_mps, body.impact_mps[0])
    assert hit_mps == pytest.approx(math.sqrt(2.0 * GRAVITY_MSS), rel=0.05)
    assert body.on_ground[0]
    assert np.abs(body.velocity_mps).max() < 1e-9
    assert body.alt_m[0] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(to_euler(body.attitude)[:, 0], [0.0, 0.0, 2.0], atol=0.2)
    np.testing.assert_allclose(body.specific_force_mss[:, 0], [0.0, 0.0, -GRAVITY_MSS], atol=1e-9)


@pytest.mark.parametrize("frame", Frame)
@given(
    thrust=st.floats(0.5, 1.2),
    tilt=st.tuples(*[st.floats(-0.2, 0.2)] * 2),
    yaw=st.floats(-0.02, 0.02),
)
@settings(max_examples=examples(15, long=60), deadline=None)
def test_the_mixer_gives_what_is_wanted(frame: Frame, thrust: float, tilt: tuple[float, float], yaw: float) -> None:
    design = replace(DESIGN, frame=frame)
    wanted = np.array([thrust * design.weight_n, *tilt, yaw])
    thrusts = Mixer(design).thrusts_n(wanted[:1], wanted[1:, np.newaxis])
    np.testing.assert_allclose(design.allocation() @ thrusts[:, 0], wanted, atol=1e-9)


@pytest.mark.parametrize("frame", Frame)
@given(thrust=st.floats(-50.0, 100.0), torque=st.tuples(*[st.floats(-20.0, 20.0)] * 3))
@settings(max_examples=examples(20, long=120), deadline=None)
def test_the_mixer_keeps_roll_and_pitch_when_it_cannot_give_all(
    frame: Frame, thrust: float, torque: tuple[float, float, float]
) -> None:
    design = replace(DESIGN, frame=frame)
    thrusts = Mixer(design).thrusts_n(np.array([thrust]), np.reshape(torque, (3, 1)))
    full_n = design.full_thrust_n
    assert thrusts.min() >= IDLE_SHARE * full_n - 1e-9
    assert thrusts.max() <= full_n + 1e-9
    given_nm = (design.allocation() @ thrusts[:, 0])[1:3]
    # The direction of the tilt always survives; its size unless the motors have no such spread.
    size, wanted = np.hypot(*given_nm), np.hypot(*torque[:2])
    np.testing.assert_allclose(given_nm * wanted, np.array(torque[:2]) * size, atol=1e-6)
    if wanted < 0.4 * design.arm_m * full_n:
        assert size == pytest.approx(wanted, abs=1e-6)


@given(turn=st.tuples(*[st.floats(-1.7, 1.7)] * 3))
def test_a_rotation_vector_survives_the_quaternion(turn: tuple[float, float, float]) -> None:
    vector = np.reshape(turn, (3, 1))
    np.testing.assert_allclose(to_vector(from_vector(vector)), vector, atol=1e-9)


@given(angles=st.tuples(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1)))
def test_euler_angles_survive_the_quaternion(angles: tuple[float, float, float]) -> None:
    q = from_euler(*np.reshape(angles, (3, 1)))
    np.testing.assert_allclose(to_euler(q)[:, 0], angles, atol=1e-6)
    rotation = matrix(q)[:, :, 0]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)


def test_turbulence_wanders_around_the_wind_and_a_gust_passes() -> None:
    air = MovingAir(200, np.random.default_rng(1), speed_mps=8.0, from_deg=270.0)
    seen = np.array([air.step(i * 0.05, 0.05) for i in range(400)])
    assert seen[:, 1].mean() == pytest.approx(8.0, abs=0.1)
    assert seen[:, 0].mean() == pytest.approx(0.0, abs=0.1)
    assert seen[:, 1].std() == pytest.approx(1.2, rel=0.1)
    calm = MovingAir(2, np.random.default_rng(1))
    calm.gust(1, (0.0, 6.0, 0.0), now_s=1.0, duration_s=2.0)
    assert np.abs(calm.step(1.0, 0.1)).max() == 0.0
    np.testing.assert_allclose(calm.step(2.0, 0.1), [[0.0, 0.0], [0.0, 6.0], [0.0, 0.0]])
    assert np.abs(calm.step(3.0, 0.1)).max() == 0.0
