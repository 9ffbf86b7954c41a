"""The published challenge with its own target, whole: a white square of 2 m with a coloured one of 1 m and a character.
Agent, controller, vision and vehicle on one clock; a busy machine changes nothing but the time."""

import pytest

from bench.challenge_one_clock import fly_on_one_clock
from bench.challenge_task import Task
from simulator.airframe_model import AirframeModel

pytestmark = pytest.mark.long("a whole flight; unit tests find the target and fly the controller")


def test_the_payload_drops_on_the_challenges_own_target() -> None:
    task = Task.drawn(3, 1, painted=True)
    flown = fly_on_one_clock(task, 1, AirframeModel.EXACT)
    assert "has landed it" in flown.words
    assert flown.letter == task.letter
    assert flown.target_m is not None
    assert flown.target_m < 0.5
    assert flown.payload_m is not None
    assert flown.payload_m < 0.5
