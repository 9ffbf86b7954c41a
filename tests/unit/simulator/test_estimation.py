"""The navigation filter keeps to its figures in a flight with noise and wind, and judges itself rightly.

The five-minute flight with a hundred vehicles is `python -m bench simulator`.
"""

from __future__ import annotations

import numpy as np
import pytest

from simulator.control.reference import standing
from simulator.control.trajectory import WayPoint, plan
from simulator.estimation.error_state import ATTITUDE, POSITION, STATES, ErrorState, FilterNoise, FirstDoubts
from simulator.estimation.fusion import GATE_SIGMAS, Component, fuse
from simulator.firmware.controller import Fleet, FleetSettings
from simulator.firmware.recorder import Recorder, level, rms
from simulator.firmware.states import SystemState

SQUARE = plan(
    [WayPoint(10, 0, 10), WayPoint(10, 10, 10), WayPoint(0, 10, 10), WayPoint(0, 0, 10)], take_off_m=10.0, land=False
)
COUNT = 8


@pytest.fixture(scope="module")
def flown() -> tuple[Fleet, Recorder]:
    """A square in a wind of 5 m/s, at a coarse step."""
    fleet = Fleet(FleetSettings(count=COUNT, dt_s=0.01, wind_mps=5.0))
    fleet.boot()
    fleet.arm()
    recorder, began_s = Recorder(fleet), fleet.now_s
    while fleet.now_s < began_s + SQUARE.duration_s + 2.0:
        fleet.step(SQUARE.at(fleet.now_s - began_s))
        recorder.note()
    return fleet, recorder


def test_the_errors_stay_within_the_figures(flown: tuple[Fleet, Recorder]) -> None:
    _, recorder = flown
    error_m = recorder.position_error_m()
    attitude = recorder.column("attitude_error_deg")
    assert rms(np.linalg.norm(attitude, axis=1)) < 2.0
    assert rms(level(error_m)) < 1.5
    assert rms(error_m[:, 2]) < 0.5
    assert rms(error_m) > 0.05, "a filter that sees the truth proves nothing"


@pytest.mark.parametrize("kind", ["gps", "velocity", "compass", "barometer"])
def test_normalised_innovations_are_chi_squared(flown: tuple[Fleet, Recorder], kind: str) -> None:
    fit = flown[1].fits[kind]
    assert len(fit.normalised) * COUNT > 700
    assert 0.92 < fit.share_inside < 0.985, "95 % should be within the 95 % bound"
    assert 0.8 < fit.mean < 1.2


def test_without_gps_the_error_grows_and_the_filter_knows(flown: tuple[Fleet, Recorder]) -> None:
    fleet, _ = flown
    fleet.board.gps.lost[:] = True
    hover = standing(np.array([0.0, 0.0, -10.0]))
    recorder, began_s = Recorder(fleet, period_s=1.0), fleet.now_s
    while fleet.now_s < began_s + 20.0:
        fleet.step(hover)
        recorder.note()
    error_m = level(recorder.position_error_m())
    assert error_m[5].max() < 3.0
    assert error_m[-1].max() < 25.0, "it drifts, it does not run away"
    assert error_m[-1].mean() > error_m[0].mean()
    spread = fleet.filter.state.spread(POSITION)[:2]
    assert (error_m[-1] < 4.0 * np.hypot(spread[0], spread[1])).all(), "the filter knows how lost it is"
    assert {c.state for c in fleet.commanders} == {SystemState.FAIL_MINOR}
    assert not fleet.filter.position_ok.any()
    fleet.board.gps.lost[:] = False
    for _ in range(600):
        fleet.step(hover)
    assert level(recorder.position_error_m()[-1:])[0].max() > 1.0
    error_m = fleet.filter.state.position_m - fleet.body.position_m
    assert np.hypot(error_m[0], error_m[1]).max() < 3.0, "found again"
    assert {c.state for c in fleet.commanders} == {SystemState.RUN_AUTO}


def test_alignment_finds_the_attitude_and_the_bias_of_the_gyroscope() -> None:
    fleet = Fleet(FleetSettings(count=10, yaw_rad=2.0, dt_s=0.01))
    fleet.boot()
    bias = np.degrees(fleet.filter.state.gyro_bias_rps - fleet.board.gyroscope.bias)
    assert np.abs(bias).max() < 0.15
    recorder = Recorder(fleet)
    recorder.note()
    assert np.abs(recorder.column("attitude_error_deg")[0, :2]).max() < 1.5
    assert np.abs(recorder.column("attitude_error_deg")[0, 2]).max() < 8.0


def state() -> ErrorState:
    error_state = ErrorState(3, FilterNoise())
    error_state.doubt(FirstDoubts(), np.arange(3))
    return error_state


def test_a_covariance_stays_symmetric_and_positive() -> None:
    error_state = state()
    turn, force = np.full((3, 3), 0.02), np.full((3, 3), -5.0)
    for i in range(300):
        error_state.spread_out(turn, force, 0.04, 0.005)
        if i % 5 == 0:
            components = [Component(np.zeros(3), ((6 + axis, 1.0), (18 + axis, 1.0)), 0.02) for axis in range(3)]
            fuse(error_state.covariance, components, np.ones(3, dtype=np.bool_))
    for covariance in error_state.covariance:
        np.testing.assert_allclose(covariance, covariance.T, atol=1e-9)
        assert np.linalg.eigvalsh(covariance).min() > -1e-9


def test_a_measurement_is_weighed_by_its_variance() -> None:
    error_state = state()
    error_state.covariance[:] = 0.0
    error_state.covariance[:, 6, 6] = 4.0
    error, fused = fuse(
        error_state.covariance,
        [Component(np.array([1.0, 1.0, 100.0]), ((6, 1.0),), 1.0)],
        np.array([True, False, True]),
    )
    assert error[:, 6].tolist() == pytest.approx([0.8, 0.0, 0.0]), "measured, not measured, not believed"
    assert error_state.covariance[:, 6, 6].tolist() == pytest.approx([0.8, 4.0, 4.0])
    assert fused.accepted.tolist() == [True, False, False]
    assert fused.worst[2] > GATE_SIGMAS
    assert error.shape == (3, STATES)


def test_an_injected_error_turns_the_attitude() -> None:
    error_state = state()
    error = np.zeros((3, STATES))
    error[1, ATTITUDE] = [0.0, 0.0, 0.3]
    error_state.inject(error)
    assert error_state.attitude[3].tolist() == pytest.approx([0.0, np.sin(0.15), 0.0])
