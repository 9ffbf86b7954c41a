"""The environment keeps to gymnasium's calls, repeats itself with a seed, and can be flown."""

from __future__ import annotations

import numpy as np
import pytest

from simulator.control.cascade import Cascade, Motion
from simulator.control.reference import standing
from simulator.environment import OBSERVATION, QuadrotorEnvironment, Task


def test_reset_and_step_have_the_shapes_of_gymnasium() -> None:
    env = QuadrotorEnvironment(count=3)
    seen, told = env.reset(seed=1)
    assert seen.shape == (3, len(OBSERVATION)) == env.observation_space.shape
    assert told == {}
    assert env.action_space.contains(env.hover_action())
    seen, reward, terminated, truncated, told = env.step(env.hover_action())
    assert seen.shape == (3, len(OBSERVATION))
    assert reward.shape == terminated.shape == truncated.shape == (3,)
    assert not told["restarted"].any()


def test_a_seed_repeats_the_flight() -> None:
    env = QuadrotorEnvironment(count=2, task=Task(wind_mps=5.0))
    ends = []
    for seed in (7, 7, 8):
        env.reset(seed=seed)
        for _ in range(20):
            seen, *_ = env.step(env.hover_action())
        ends.append(seen)
    np.testing.assert_array_equal(ends[0], ends[1])
    assert np.abs(ends[0] - ends[2]).max() > 1e-3


def test_a_fall_ends_the_flight_and_starts_another() -> None:
    env = QuadrotorEnvironment(count=1)
    env.reset(seed=2)
    ended_at = None
    for step in range(400):
        seen, reward, terminated, _, told = env.step(np.zeros((1, 4)))
        if terminated[0]:
            ended_at = step
            assert reward[0] < -5.0
            break
    assert ended_at is not None
    seen, _, terminated, _, told = env.step(env.hover_action())
    assert told["restarted"][0]
    assert not terminated[0]
    assert np.abs(seen[0, :3]).max() <= 3.1


def test_time_ends_a_flight_without_a_fault() -> None:
    env = QuadrotorEnvironment(task=Task(max_steps=5, start_tilt_rad=0.0, start_spread_m=0.0))
    env.reset(seed=1)
    flags = [env.step(env.hover_action())[2:4] for _ in range(5)]
    assert [bool(truncated[0]) for _, truncated in flags] == [False] * 4 + [True]
    assert not any(terminated[0] for terminated, _ in flags)


@pytest.mark.parametrize("action", [np.zeros(4), np.zeros((2, 4)), np.full((1, 4), np.nan)])
def test_what_is_no_action_is_refused(action: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> None:
    with pytest.raises(ValueError, match="four shares"):
        QuadrotorEnvironment().step(action)


def test_the_cascade_collects_more_reward_than_hovering_blindly() -> None:
    env = QuadrotorEnvironment(count=4, task=Task(wind_mps=3.0, max_steps=300))
    sums = {}
    for name in ("blind", "cascade"):
        env.reset(seed=3)
        cascade, total = Cascade(env.design, 4), 0.0
        for _ in range(300):
            body = env.body
            motion = Motion(body.position_m, body.velocity_mps, body.attitude, body.rates_rps)
            flown = cascade.commands(motion, standing(env.goal_m[:, 0]), 0.01).T ** 2
            _, reward, *_ = env.step(flown if name == "cascade" else env.hover_action())
            total += float(reward.sum())
        sums[name] = total
    assert sums["cascade"] > sums["blind"] + 100.0
