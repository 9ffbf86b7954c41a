"""The airframe as an environment for controllers and learners, with the calls of gymnasium: `reset` and `step`.

gymnasium itself is not needed. Several vehicles fly side by side; every array has them in its first axis, and one that
ends starts again at the next step, as gymnasium's vector environments do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from simulator.physics.mixer import Mixer
from simulator.physics.moving_air import MovingAir
from simulator.physics.quadrotor import Quadrotors
from simulator.physics.quadrotor_design import QuadrotorDesign
from simulator.physics.rotation import Floats, from_euler, level, matrix

Flags = npt.NDArray[np.bool_]

OBSERVATION: Final = (
    "north_m", "east_m", "down_m", "v_north_mps", "v_east_mps", "v_down_mps",
    "q_w", "q_x", "q_y", "q_z", "p_rps", "q_rps", "r_rps", "rotor_1", "rotor_2", "rotor_3", "rotor_4",
)  # fmt: skip
"""Positions and speeds relative to the goal; rotors as shares of full speed."""


@dataclass(frozen=True, slots=True)
class Box:
    """What gymnasium calls a Box space."""

    low: Floats
    high: Floats

    @property
    def shape(self) -> tuple[int, ...]:
        return self.low.shape

    def contains(self, value: Floats) -> bool:
        return bool(value.shape == self.shape and (value >= self.low).all() and (value <= self.high).all())


@dataclass(frozen=True, slots=True)
class Task:
    """Fly to a goal 10 m up and stay."""

    start_spread_m: float = 3.0
    start_tilt_rad: float = 0.4
    wind_mps: float = 0.0
    dt_s: float = 0.01
    max_steps: int = 1000
    bounds_m: float = 15.0
    """Farther from the goal the flight ends."""


class QuadrotorEnvironment:
    """Actions are shares of full thrust of each motor, 0..1; (vehicles, 4)."""

    def __init__(self, count: int = 1, task: Task | None = None, design: QuadrotorDesign | None = None) -> None:
        self.count = count
        self.task = task or Task()
        self.design = design or QuadrotorDesign()
        self.goal_m = np.array([[0.0], [0.0], [-10.0]])
        self.action_space = Box(np.zeros((count, 4)), np.ones((count, 4)))
        far = np.full((count, len(OBSERVATION)), np.inf)
        self.observation_space = Box(-far, far)
        self._random = np.random.default_rng(0)
        self._again = np.zeros(count, dtype=np.bool_)
        self._start()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Without a seed chance goes on where it was. `options` has none."""
        del options
        if seed is not None:
            self._random = np.random.default_rng(seed)
        self._start()
        return self._observe(), {}

    def step(self, action: Floats) -> tuple[Floats, Floats, Flags, Flags, dict[str, Any]]:
        """Returns observations, rewards, ended by itself, ended by time, and `{"restarted": ...}`.

        Raises ValueError for an action of another shape or without a value."""
        action = np.asarray(action, dtype=np.float64)
        if action.shape != (self.count, 4) or not np.isfinite(action).all():
            raise ValueError(f"an action is {self.count} times four shares of thrust")
        restarted = self._again.copy()
        if restarted.any():
            self._place(restarted)
        wind = self._air.step(self._steps.max() * self.task.dt_s, self.task.dt_s)
        self.body.step(np.sqrt(np.clip(action.T, 0.0, 1.0)), self.task.dt_s, wind)
        self._steps += 1
        away = self.body.position_m - self.goal_m
        distance = np.sqrt(np.einsum("in,in->n", away, away))
        spin = np.sqrt(np.einsum("in,in->n", self.body.rates_rps, self.body.rates_rps))
        effort = np.mean(action, axis=1)
        reward = np.exp(-0.5 * distance) - 0.01 * spin - 0.01 * effort
        terminated = (distance > self.task.bounds_m) | self.body.on_ground
        truncated = (self._steps >= self.task.max_steps) & ~terminated
        reward = np.where(terminated, reward - 10.0, reward)
        self._again = terminated | truncated
        return self._observe(), reward, terminated, truncated, {"restarted": restarted}

    def hover_action(self) -> Floats:
        """What keeps a level vehicle in still air where it is: a start for controllers."""
        thrust = Mixer(self.design).thrusts_n(np.array([self.design.weight_n]), np.zeros((3, 1)))
        return np.asarray(np.repeat(thrust.T / self.design.full_thrust_n, self.count, axis=0))

    def _start(self) -> None:
        self.body = Quadrotors(self.design, self.count)
        self._air = MovingAir(self.count, self._random, speed_mps=self.task.wind_mps)
        self._steps = np.zeros(self.count, dtype=np.int64)
        self._place(np.ones(self.count, dtype=np.bool_))

    def _place(self, which: Flags) -> None:
        body, task, many = self.body, self.task, int(which.sum())
        spread = self._random.uniform(-1.0, 1.0, (6, many))
        body.position_m[:, which] = self.goal_m + task.start_spread_m * spread[:3]
        body.velocity_mps[:, which] = body.rates_rps[:, which] = 0.0
        tilt = task.start_tilt_rad * spread[3:5]
        body.attitude[:, which] = from_euler(tilt[0], tilt[1], np.pi * spread[5]) if many else level(0)
        body.rotation = matrix(body.attitude)
        body.rotor_rps[:, which] = self.design.hover_speed_rps
        body.on_ground[which] = False
        self._steps[which] = 0

    def _observe(self) -> Floats:
        body = self.body
        rotors = body.rotor_rps / self.design.full_speed_rps
        parts = (body.position_m - self.goal_m, body.velocity_mps, body.attitude, body.rates_rps, rotors)
        return np.concatenate(parts).T.copy()
