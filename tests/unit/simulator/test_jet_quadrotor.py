"""The jet quadcopter: slow turbine, limited servos, and the findings of the published square test."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from simulator.physics.jet_quadrotor import JetDesign, JetQuadrotorDesign, JetQuadrotors
from simulator.physics.rigid_body import GRAVITY_MSS
from simulator.physics.rotation import from_euler, matrix
from simulator.studies.jet_square import HEIGHT_M, VERTICAL_JET_DEG, Case, SquareFlight, fly
from simulator.studies.jet_square_page import ROWS, picture, table

DT_S = 0.005
STILL = np.zeros((3, 1))
OFF = np.zeros((4, 1))
DESIGN = JetQuadrotorDesign()


study = pytest.mark.long("a study of a vehicle that nothing else flies")


@pytest.fixture(scope="module")
def flights() -> dict[Case, SquareFlight]:
    return {case: fly(case) for case in Case}


@study
def test_the_quadrotor_alone_oscillates_by_a_fifth_of_a_metre_and_the_jet_damps_it(
    flights: dict[Case, SquareFlight],
) -> None:
    alone = flights[Case.ALONE]
    assert 0.1 < alone.oscillation_m < 0.35
    assert alone.overshoot_m < 0.2
    for case in (Case.JET, Case.REFINED):
        assert flights[case].oscillation_m < 0.5 * alone.oscillation_m


@study
def test_the_jet_overshoots_the_height_by_metres_and_refined_by_more_than_its_whole(
    flights: dict[Case, SquareFlight],
) -> None:
    assert 2.0 < flights[Case.JET].overshoot_m < HEIGHT_M
    assert flights[Case.REFINED].overshoot_m > flights[Case.JET].overshoot_m
    assert flights[Case.REFINED].overshoot_m > 0.95 * HEIGHT_M


@study
def test_refined_it_keeps_an_error_and_oscillates_in_height(flights: dict[Case, SquareFlight]) -> None:
    refined, alone = flights[Case.REFINED], flights[Case.ALONE]
    assert 0.25 < refined.steady_error_m < 1.6
    assert refined.height_oscillation_m > 0.5
    assert alone.height_oscillation_m < 0.05


@study
def test_the_servos_keep_the_jet_near_the_vertical_and_everyone_lands(flights: dict[Case, SquareFlight]) -> None:
    for case, flight in flights.items():
        assert flight.landed, case
        assert flight.worst_tilt_deg < VERTICAL_JET_DEG
    assert flights[Case.JET].worst_tilt_deg > 1.0, "servos have limits"


@study
def test_the_table_and_the_picture_show_all_three(flights: dict[Case, SquareFlight]) -> None:
    text = table(list(flights.values()))
    assert len(text.splitlines()) == 2 + len(ROWS)
    assert len({line.count("|") for line in text.splitlines()}) == 1
    lines = ElementTree.fromstring(picture(list(flights.values()))).iter("{http://www.w3.org/2000/svg}polyline")
    assert len(list(lines)) == 3 + 4 + 2 + 2


def test_a_turbine_spools_slowly_and_no_lower_than_idle() -> None:
    body = JetQuadrotors(DESIGN)
    body.throttle[:] = 1.0
    for _ in range(round(1.0 / DT_S)):
        body.step(OFF, DT_S, STILL)
    jet = DESIGN.jet
    assert body.spool[0] == pytest.approx(jet.idle_share + jet.spool_share_per_s, rel=0.02)
    body.throttle[:] = 0.0
    for _ in range(round(20.0 / DT_S)):
        body.step(OFF, DT_S, STILL)
    assert body.spool[0] == pytest.approx(jet.idle_share, abs=1e-3)


def test_the_jet_carries_the_weight_that_it_was_built_for() -> None:
    body = JetQuadrotors(DESIGN)
    body.spool[:] = body.throttle[:] = DESIGN.carrying_share
    assert body.jet_thrust_n[0] == pytest.approx(DESIGN.carried_n)
    assert body.mass_kg[0] * GRAVITY_MSS == pytest.approx(DESIGN.carried_n + DESIGN.quadrotor.weight_n)
    before_kg = body.mass_kg[0]
    for _ in range(round(10.0 / DT_S)):
        body.step(OFF, DT_S, STILL)
    assert before_kg - body.mass_kg[0] == pytest.approx(10.0 * DESIGN.carried_n * DESIGN.jet.fuel_kg_per_ns, rel=0.01)
    body.fuel_kg[:] = 0.0
    assert body.jet_thrust_n[0] == 0.0


def test_servos_are_limited_in_speed_and_turn_the_vehicle_the_other_way() -> None:
    body = JetQuadrotors(JetQuadrotorDesign(jet=JetDesign(rotor_momentum_nms=0.0)))
    body.position_m[2] = -50.0
    body.gimbal_rad[:] = [[0.5], [0.0]]
    fastest, kick = 0.0, 0.0
    for _ in range(60):
        body.step(OFF, DT_S, STILL)
        fastest = max(fastest, float(abs(body.angle_rate_rps[0, 0])))
        kick = min(kick, float(body.rates_rps[0, 0]))
    assert 0.0 < fastest <= DESIGN.jet.servo_speed_rps
    assert kick < -0.05
    assert body.angle_rad[0, 0] == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize(("roll", "pitch"), [(0.2, 0.0), (0.0, -0.3), (0.15, 0.25)])
def test_the_gimbal_makes_a_leaning_vehicles_jet_vertical(roll: float, pitch: float) -> None:
    body = JetQuadrotors(DESIGN)
    body.attitude = from_euler(np.array([roll]), np.array([pitch]), np.array([1.0]))
    body.rotation = matrix(body.attitude)
    body.angle_rad = np.array([[-roll], [-pitch]])
    assert body.jet_tilt_rad()[0] == pytest.approx(0.0, abs=1e-7)
