"""Sensors that fail in ways that the table of faults does not have. `python -m bench sensor_faults` flies a hundred
vehicles with each of twelve."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pytest

from simulator.control.reference import standing
from simulator.control.trajectory import plan
from simulator.estimation.heading_check import LEG_S, HeadingCheck
from simulator.firmware.commander import Commander
from simulator.firmware.controller import Fleet, FleetSettings
from simulator.firmware.health import LANDS_AFTER_S, Sensor
from simulator.firmware.states import SystemState
from simulator.physics.rotation import conjugate, multiply, to_vector
from simulator.sensors.magnetometer import earth_field_gauss

HOVER = standing(np.array([0.0, 0.0, -10.0]))
FAULT_S, AFTER_S = 33.0, 14.0
HEALTHY, SLOW_YAW, FAST_YAW, COMPASS, HEIGHT, POSITION, DEAD_GYRO, JUMP = range(8)
EACH = np.eye(3)[:, :, np.newaxis]


def off_deg(fleet: Fleet) -> np.ndarray:
    error = to_vector(multiply(conjugate(fleet.body.attitude), fleet.filter.state.attitude))
    return np.degrees(np.linalg.norm(error, axis=0))


@dataclass
class Told:
    """`recovered_deg`: how wrong the attitude was, whenever it said "Recovered"."""

    texts: list[str] = field(default_factory=list)
    recovered_deg: list[float] = field(default_factory=list)


class Story:
    """Eight vehicles in hover, seven with a fault of their own."""

    def __init__(self) -> None:
        self.fleet = fleet = Fleet(FleetSettings(count=8, dt_s=0.02, wind_mps=2.0))
        self.told = [Told() for _ in range(8)]
        fleet.boot()
        fleet.arm()
        up = plan([], take_off_m=10.0, land=False)
        began_s = fleet.now_s
        while fleet.now_s < began_s + up.duration_s + 2.0:
            fleet.step(up.at(fleet.now_s - began_s))
        for commander in fleet.commanders:
            commander.texts.clear()
        self.flown_m = np.zeros(8)
        self.set(1.0)
        self.run(FAULT_S)
        self.set(0.0)
        self.run(AFTER_S)

    def set(self, size: float) -> None:
        board = self.fleet.board
        board.gyroscope.offset[2, [SLOW_YAW, FAST_YAW]] = np.radians([2.0, 5.0]) * size
        board.magnetometer.jump_gauss[1, COMPASS] = 0.35 * size
        board.barometer.silent[HEIGHT] = board.gps.silent[POSITION] = board.gyroscope.silent[DEAD_GYRO] = size > 0.0
        board.gps.jump_m[:2, JUMP] = 40.0 * size

    def run(self, seconds: float) -> None:
        fleet = self.fleet
        for _ in range(round(seconds / fleet.dt_s)):
            fleet.step(HOVER)
            apart = np.hypot(*fleet.body.position_m[:2])
            self.flown_m = np.where(fleet.armed, np.maximum(self.flown_m, apart), self.flown_m)
            for vehicle, commander in enumerate(fleet.commanders):
                while commander.texts:
                    text = commander.texts.popleft().text
                    self.told[vehicle].texts.append(text)
                    if text == "Recovered":
                        self.told[vehicle].recovered_deg.append(float(off_deg(fleet)[vehicle]))


@pytest.fixture(scope="module")
def story() -> Story:
    return Story()


def test_nobody_recovers_with_a_wrong_attitude(story: Story) -> None:
    wrong = [max(told.recovered_deg, default=0.0) for told in story.told]
    assert max(wrong) < 10.0, wrong


@pytest.mark.parametrize("vehicle", [SLOW_YAW, FAST_YAW])
def test_a_gyroscope_that_begins_to_turn_is_corrected_by_the_compass(story: Story, vehicle: int) -> None:
    assert off_deg(story.fleet)[vehicle] < 6.0
    assert story.fleet.commanders[vehicle].state is SystemState.RUN_AUTO, story.told[vehicle].texts
    assert story.flown_m[vehicle] < 5.0


def test_a_disturbed_compass_leaves_the_heading_doubtful_until_it_lands(story: Story) -> None:
    texts = story.told[COMPASS].texts
    assert "Heading doubtful" in texts
    assert "Recovered" not in texts
    assert "In doubt for too long" in texts
    assert story.flown_m[COMPASS] < 10.0


def test_what_is_no_number_reaches_no_state(story: Story) -> None:
    state = story.fleet.filter.state
    for part in (state.attitude, state.position_m, state.velocity_mps, state.gyro_bias_rps, state.barometer_bias_m):
        assert np.isfinite(part).all()
    assert np.isfinite(state.covariance).all()
    assert "Barometer stuck" in story.told[HEIGHT].texts
    assert story.fleet.commanders[HEIGHT].state is SystemState.RUN_AUTO
    assert story.fleet.body.alt_m[HEIGHT] == pytest.approx(10.0, abs=3.0)


def test_without_a_position_it_lands_after_a_while(story: Story) -> None:
    assert {"Position unknown", "In doubt for too long"} <= set(story.told[POSITION].texts)
    assert not story.fleet.armed[POSITION]


def test_a_dead_gyroscope_is_not_found_and_ends_the_flight(story: Story) -> None:
    assert f"{Sensor.GYROSCOPE} not found" in story.told[DEAD_GYRO].texts
    assert not story.fleet.armed[DEAD_GYRO]


def test_positions_that_jump_far_are_landed_with_and_not_flown_to(story: Story) -> None:
    assert "Too far from its place" in story.told[JUMP].texts
    assert story.flown_m[JUMP] < 15.0


def test_the_one_beside_them_notices_nothing(story: Story) -> None:
    assert story.told[HEALTHY].texts == []


def test_motion_tells_a_wrong_heading() -> None:
    """Two vehicles, one of which believes a heading that is 25 degrees too large."""
    check, rng = HeadingCheck(2), np.random.default_rng(3)
    felt, seen = np.zeros((2, 2)), np.zeros((2, 2))
    turn = math.radians(25.0)
    assert np.isnan(check.motion_off_rad).all()
    for number in range(12):
        step = rng.uniform(-2.0, 2.0, 2)
        seen += step[:, np.newaxis]
        felt[:, 0] += step
        felt[:, 1] += np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]) @ step
        heard = seen + rng.normal(0.0, 0.08, (2, 2))
        check.take_velocity(felt.copy(), heard, np.ones(2, dtype=np.bool_), number * LEG_S)
    assert np.degrees(check.motion_off_rad) == pytest.approx([0.0, 25.0], abs=6.0)


def test_a_field_that_jumps_is_no_gyroscope_that_drifts() -> None:
    check, everyone = HeadingCheck(1), np.ones(1, dtype=np.bool_)
    field = earth_field_gauss()
    check.start(np.array([0]), 0.0)
    turned = np.array([[field[0, 0] * math.cos(0.5)], [field[0, 0] * math.sin(0.5)], field[2]])
    drifted = False
    for number in range(1, 200):
        value = field if number < 50 else turned
        drifted |= bool(check.take_compass(EACH, value, everyone, number * 0.04)[0])
    assert not drifted
    assert not check.known[0]
    for number in range(200, 300):
        check.take_compass(EACH, field, everyone, number * 0.04)
    assert check.known[0], "it is as before again"


@pytest.mark.parametrize("text", LANDS_AFTER_S)
def test_doubt_has_a_limit_of_time(text: str) -> None:
    flags = {
        "Position unknown": "position_known",
        "GPS glitch": "gps_believed",
        "Compass inconsistent": "compass_believed",
        "Heading doubtful": "heading_known",
        "Blown away": "in_place",
    }
    commander = Commander()
    commander.health.attitude_known = commander.health.position_known = commander.health.gps_fix = True
    for now in (0.0, 0.1, 0.2):
        commander.update(now)
    commander.auto()
    setattr(commander.health, flags[text], False)
    now = 1.0
    while now < LANDS_AFTER_S[text] + 0.9:
        commander.update(now)
        assert commander.state is SystemState.FAIL_MINOR
        now += 0.1
    for _ in range(3):
        commander.update(now := now + 0.1)
    assert commander.state is SystemState.FAIL_MAJOR
    assert [notice.text for notice in commander.texts].count("In doubt for too long") == 1


def test_far_from_its_place_it_lands() -> None:
    commander = Commander()
    commander.health.attitude_known = commander.health.position_known = commander.health.gps_fix = True
    for now in (0.0, 0.1, 0.2):
        commander.update(now)
    commander.auto()
    commander.health.far_away, commander.health.in_place = True, False
    commander.update(1.0)
    assert commander.state is SystemState.FAIL_MAJOR
