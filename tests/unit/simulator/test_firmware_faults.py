"""Each fault leads to the state and the text of its table, and to nothing at the vehicle beside it."""

from __future__ import annotations

import numpy as np
import pytest

from simulator.control.reference import standing
from simulator.control.trajectory import plan
from simulator.firmware.commander import RECOVERED_AFTER_S
from simulator.firmware.controller import Fleet, FleetSettings
from simulator.firmware.fault_table import TABLE, FaultName
from simulator.firmware.faults import GUST_S, begin, end
from simulator.firmware.recorder import level
from simulator.firmware.states import SystemState
from simulator.physics.rotation import tilt_rad

HOVER = standing(np.array([0.0, 0.0, -10.0]))
WATCHED_S = 7.0
JUMPED_S = 5.0
COUNT = len(FaultName) + 1
HEALTHY = COUNT - 1


def texts(fleet: Fleet, vehicle: int) -> list[str]:
    return [notice.text for notice in fleet.commanders[vehicle].texts]


class Story:
    """A fleet in hover: each vehicle but the last has a fault of its own for `WATCHED_S`, then time to recover."""

    def __init__(self) -> None:
        self.fleet = fleet = Fleet(FleetSettings(count=COUNT, dt_s=0.01))
        fleet.boot()
        fleet.arm()
        up = plan([], take_off_m=10.0, land=False)
        began_s = fleet.now_s
        while fleet.now_s < began_s + up.duration_s + 2.0:
            fleet.step(up.at(fleet.now_s - began_s))
        for vehicle in range(COUNT):
            fleet.commanders[vehicle].texts.clear()
        for vehicle, name in enumerate(FaultName):
            begin(fleet, name, vehicle)
        began_s = fleet.now_s
        self.reached_s: dict[FaultName, float] = {}
        self.highest_tilt = np.zeros(COUNT)
        while fleet.now_s < began_s + WATCHED_S:
            fleet.step(HOVER)
            if fleet.now_s > began_s + JUMPED_S:
                end(fleet, FaultName.GPS_JUMP, list(FaultName).index(FaultName.GPS_JUMP))
            self.highest_tilt = np.maximum(self.highest_tilt, tilt_rad(fleet.body.attitude))
            for vehicle, name in enumerate(FaultName):
                if fleet.commanders[vehicle].state is TABLE[name].state:
                    self.reached_s.setdefault(name, fleet.now_s - began_s)
        self.said = [texts(fleet, vehicle) for vehicle in range(COUNT)]
        self.off_m = np.hypot(*(fleet.body.position_m[:2]))
        for vehicle, name in enumerate(FaultName):
            if name is not FaultName.MOTOR_LOSS:
                end(fleet, name, vehicle)
        for _ in range(round((RECOVERED_AFTER_S + GUST_S + 6.0) / fleet.dt_s)):
            fleet.step(HOVER)


@pytest.fixture(scope="module")
def story() -> Story:
    return Story()


@pytest.mark.parametrize("name", FaultName)
def test_a_fault_leads_to_its_state_and_its_text(story: Story, name: FaultName) -> None:
    row, said = TABLE[name], story.said[list(FaultName).index(name)]
    assert story.reached_s.get(name, 99.0) <= row.within_s
    if row.text:
        assert row.text in said
    else:
        assert said == []


def test_nothing_happens_to_the_vehicle_beside_them(story: Story) -> None:
    assert story.said[HEALTHY] == []
    assert story.fleet.commanders[HEALTHY].state is SystemState.RUN_AUTO
    assert story.off_m[HEALTHY] < 3.0


@pytest.mark.parametrize("name", [name for name in FaultName if TABLE[name].state is SystemState.FAIL_MINOR])
def test_a_minor_fault_is_survived_and_recovered_from(story: Story, name: FaultName) -> None:
    vehicle = list(FaultName).index(name)
    assert story.fleet.commanders[vehicle].state is SystemState.RUN_AUTO, texts(story.fleet, vehicle)
    assert story.highest_tilt[vehicle] < 1.2
    assert story.fleet.body.alt_m[vehicle] == pytest.approx(10.0, abs=2.0)


def test_a_lost_motor_ends_on_the_ground_and_disarmed(story: Story) -> None:
    vehicle = list(FaultName).index(FaultName.MOTOR_LOSS)
    assert story.fleet.commanders[vehicle].state is SystemState.SAFE
    assert not story.fleet.armed[vehicle]
    assert story.fleet.body.on_ground[vehicle]


def test_a_gps_jump_is_not_followed(story: Story) -> None:
    assert story.off_m[list(FaultName).index(FaultName.GPS_JUMP)] < 5.0


def test_a_lost_radio_is_a_fault_when_sticks_fly() -> None:
    fleet = Fleet(FleetSettings(dt_s=0.02))
    fleet.boot()
    fleet.commanders[0].run_manual()
    begin(fleet, FaultName.RADIO_LOSS)
    for _ in range(20):
        fleet.step()
    assert fleet.commanders[0].state is SystemState.FAIL_MINOR
    assert "Radio lost" in texts(fleet, 0)


def test_the_same_seed_flies_the_same_flight_and_another_seed_another() -> None:
    def end_of(seed: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        fleet = Fleet(FleetSettings(count=3, seed=seed, dt_s=0.02, wind_mps=4.0))
        fleet.boot()
        fleet.arm()
        for _ in range(150):
            fleet.step(HOVER)
        return fleet.body.position_m

    np.testing.assert_array_equal(end_of(1), end_of(1))
    assert np.abs(end_of(1) - end_of(2)).max() > 1e-3
    assert level(end_of(1)[np.newaxis])[0].max() < 5.0


def test_a_gps_that_comes_back_is_no_glitch() -> None:
    fleet = Fleet(FleetSettings(dt_s=0.01))
    fleet.boot()
    fleet.arm()
    up = plan([], take_off_m=10.0, land=False)
    began_s = fleet.now_s
    while fleet.now_s < began_s + up.duration_s + 1.0:
        fleet.step(up.at(fleet.now_s - began_s))
    begin(fleet, FaultName.GPS_LOSS)
    for _ in range(300):
        fleet.step(HOVER)
    end(fleet, FaultName.GPS_LOSS)
    for _ in range(500):
        fleet.step(HOVER)
    assert "GPS lost" in texts(fleet, 0)
    assert "Recovered" in texts(fleet, 0)
    assert "GPS glitch" not in texts(fleet, 0)
