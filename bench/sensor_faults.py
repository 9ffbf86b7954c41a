"""Sensors that fail in flight in twelve ways that the table of faults does not have: a hundred vehicles with each, in
hover, on an eight and along a way, with wind. Who says "Recovered" with a wrong attitude, who flies away, who lands.

`--rounds N` flies so many with each fault (100), `--seed N` others.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from bench.rows import Report
from simulator.control.figure_of_eight import FigureOfEight
from simulator.control.reference import Reference, standing
from simulator.control.trajectory import PlanLimits, Trajectory, WayPoint, plan
from simulator.firmware.controller import Fleet, FleetSettings
from simulator.firmware.health import FAR_M
from simulator.firmware.states import SystemState
from simulator.physics.rotation import Floats, conjugate, multiply, to_vector

UP_M: Final = 10.0
RUNS: Final = 100
FAULT_S: Final = 25.0
"""How long the fault lasts; then as long again without it."""
WATCHED_S: Final = 60.0
MAX_OFF_DEG: Final = 10.0
LIMIT_M: Final = FAR_M + 25.0
"""From its place, in truth, while it has not landed: its own limit, and the way until it has noticed and is down."""
STEP_S: Final = 0.01

Spread = Floats
Act = Callable[[Fleet, Spread, bool], None]
"""Begins (True) or ends a fault at all vehicles; the spread is a number from -1 to 1 for each."""


def _gyroscope(axis: int, degrees_s: float) -> Act:
    def act(fleet: Fleet, spread: Spread, begins: bool) -> None:
        fleet.board.gyroscope.offset[axis] = math.radians(degrees_s) * np.sign(spread) if begins else 0.0

    return act


def _accelerometer(fleet: Fleet, spread: Spread, begins: bool) -> None:
    fleet.board.accelerometer.offset[0] = spread if begins else 0.0


def _flag(part: str, name: str) -> Act:
    def act(fleet: Fleet, spread: Spread, begins: bool) -> None:
        getattr(getattr(fleet.board, part), name)[:] = begins

    return act


def _compass_jump(fleet: Fleet, spread: Spread, begins: bool) -> None:
    fleet.board.magnetometer.jump_gauss[1] = 0.35 * spread if begins else 0.0


def _gps_jump(fleet: Fleet, spread: Spread, begins: bool) -> None:
    fleet.board.gps.jump_m[:2] = 40.0 * spread if begins else 0.0


FAULTS: Final[dict[str, Act]] = {
    "yaw gyro, 2 deg/s": _gyroscope(2, 2.0),
    "yaw gyro, 5 deg/s": _gyroscope(2, 5.0),
    "roll gyro, 2 deg/s": _gyroscope(0, 2.0),
    "accelerometer, up to 1 m/s2": _accelerometer,
    "gyroscope stuck": _flag("gyroscope", "stuck"),
    "accelerometer stuck": _flag("accelerometer", "stuck"),
    "compass stuck": _flag("magnetometer", "stuck"),
    "compass jump, up to 0.35 gauss": _compass_jump,
    "height is no number": _flag("barometer", "silent"),
    "position is no number": _flag("gps", "silent"),
    "gyroscope is no number": _flag("gyroscope", "silent"),
    "position jumps by up to 57 m": _gps_jump,
}


@dataclass
class Outcome:
    """Of the vehicles with one fault."""

    recovered_wrong: int = 0
    recovered: int = 0
    worst_recovered_deg: float = 0.0
    too_far: int = 0
    farthest_m: float = 0.0
    landed: int = 0
    not_a_number: int = 0
    off_deg: list[float] = field(default_factory=list)
    """At the end, of those that fly."""


def ways(number: int) -> FigureOfEight | Trajectory | _Hover:
    """A hover, an eight, and a square."""
    if number == 0:
        return _Hover()
    if number == 1:
        return FigureOfEight(8.0, 14.0, UP_M, rounds=6, yaw_rad=0.7 * number)
    corners = [WayPoint(north, east, UP_M) for north, east in ((15.0, 0.0), (15.0, 15.0), (0.0, 15.0), (0.0, 0.0)) * 2]
    trajectory = Trajectory(np.array([0.0, 0.0, -UP_M]), 0.7 * number)
    for corner in corners:
        trajectory.fly_to(corner, PlanLimits())
    return trajectory


class _Hover:
    duration_s = math.inf

    def at(self, time_s: float) -> Reference:
        return standing(np.array([0.0, 0.0, -UP_M]))


def off_deg(fleet: Fleet) -> Floats:
    """How far the believed attitude is from the true one."""
    error = to_vector(multiply(conjugate(fleet.body.attitude), fleet.filter.state.attitude))
    return np.asarray(np.degrees(np.linalg.norm(error, axis=0)))


def fly(act: Act, count: int, seed: int, way: int, outcome: Outcome) -> None:
    """Flies `count` vehicles at once."""
    random = np.random.default_rng((seed, way, 7))
    spread = random.uniform(0.4, 1.0, count) * random.choice([-1.0, 1.0], count)
    fleet = Fleet(FleetSettings(count=count, seed=seed + way, dt_s=STEP_S, wind_mps=2.0 * way, yaw_rad=0.7 * way))
    fleet.boot()
    fleet.arm()
    up, path = plan([], take_off_m=UP_M, land=False, yaw_rad=0.7 * way), ways(way)
    began_s = fleet.now_s
    while fleet.now_s < began_s + up.duration_s + 3.0:
        fleet.step(up.at(fleet.now_s - began_s))
    for commander in fleet.commanders:
        commander.texts.clear()
    began_s, started, ended = fleet.now_s, False, False
    down = np.zeros(count, dtype=np.bool_)
    farthest = np.zeros(count)
    while fleet.now_s < began_s + WATCHED_S:
        at_s = fleet.now_s - began_s
        if at_s >= 2.0 and not started:
            act(fleet, spread, True)
            started = True
        if at_s >= 2.0 + FAULT_S and not ended:
            act(fleet, spread, False)
            ended = True
        reference = path.at(min(at_s, path.duration_s))
        fleet.step(reference)
        for vehicle, commander in enumerate(fleet.commanders):
            while commander.texts:
                if commander.texts.popleft().text == "Recovered":
                    wrong_deg = float(off_deg(fleet)[vehicle])
                    outcome.recovered += 1
                    outcome.recovered_wrong += wrong_deg > MAX_OFF_DEG
                    outcome.worst_recovered_deg = max(outcome.worst_recovered_deg, wrong_deg)
        down |= ~fleet.armed
        apart = np.hypot(*(fleet.body.position_m[:2] - np.reshape(reference.position_m[:2], (2, -1))))
        farthest = np.where(down, farthest, np.maximum(farthest, apart))
        if down.all():
            break
    outcome.too_far += int((farthest > LIMIT_M).sum())
    outcome.farthest_m = max(outcome.farthest_m, float(farthest.max()))
    outcome.landed += int(down.sum())
    state = fleet.filter.state
    numbers = np.isfinite(np.concatenate([state.position_m, state.velocity_mps, state.attitude])).all(axis=0)
    outcome.not_a_number += int((~numbers).sum())
    flying = np.array([c.state is SystemState.RUN_AUTO for c in fleet.commanders])
    outcome.off_deg += off_deg(fleet)[flying].tolist()


async def run(report: Report, options: argparse.Namespace) -> None:
    count = options.rounds or (12 if options.quick else RUNS)
    for name, act in FAULTS.items():
        outcome = Outcome()
        for way in range(3):
            fly(act, count // 3 + (way < count % 3), options.seed, way, outcome)
        case = f"{name}, {count} flights"
        report.add(case, "recovered", outcome.recovered, "count")
        report.add(case, "recovered_with_more_than_10_deg", outcome.recovered_wrong, "count")
        report.add(case, "worst_recovered", outcome.worst_recovered_deg, "deg")
        report.add(case, "landed", outcome.landed, "count")
        report.add(case, f"farther_than_{LIMIT_M:.0f}_m", outcome.too_far, "count")
        report.add(case, "farthest", outcome.farthest_m, "m")
        report.add(case, "states_that_are_no_number", outcome.not_a_number, "count")
        if outcome.off_deg:
            report.spread(case, "attitude_error_at_the_end", outcome.off_deg, "deg")
