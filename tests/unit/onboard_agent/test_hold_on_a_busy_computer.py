"""A hold while the agent's computer is busy or the line is slow: what is requested too late must not undo the hold."""

import random

import pytest
from worlds.held_copter import HeldCopter
from worlds.model_copter import Mode, ModelCopter, Receiver
from worlds.tiers import examples

HEIGHT_M = 8.0
HELD_FOR_S = 20.0
FLIGHTS = examples(24, long=200)


def taken(seed: int, mode: Mode) -> tuple[HeldCopter, random.Random]:
    copter = ModelCopter(50.0, receiver=Receiver.LOW, parameters={"FS_GCS_ENABLE": 1.0}, height_m=HEIGHT_M, mode=mode)
    world = HeldCopter(copter, step_s=0.05, knows_s=1.0)
    world.take()
    return world, random.Random(seed)


@pytest.mark.parametrize("seed", range(FLIGHTS))
def test_a_busy_computer_changes_nothing_of_the_hold(seed: int) -> None:
    """Before, 24 flights of 120 ended in ALT HOLD with no sticks, on the ground: the agent had left BRAKE for it before
    it read that BRAKE was confirmed, and took its own request for somebody else's."""
    world, chance = taken(seed, Mode.GUIDED)
    world.copter.ack_after_s = chance.choice([0.003, 0.3])
    until = world.now + HELD_FOR_S
    while world.now < until:
        busy_s = chance.choice([0.1, 0.3, 0.8, 1.5, 2.5])
        world.stalled_until = world.now + busy_s
        world.pass_time(busy_s + chance.choice([0.05, 0.05, 0.2]))
    assert {change.mode for change in world.copter.changes} == {Mode.BRAKE}
    assert world.copter.height_m == pytest.approx(HEIGHT_M, abs=0.5)
    assert world.agent.hold.open


@pytest.mark.parametrize("seed", range(FLIGHTS))
def test_slow_and_lost_answers_beside_it_do_not_make_it_sink(seed: int) -> None:
    world, chance = taken(seed, random.Random(seed).choice([Mode.GUIDED, Mode.AUTO, Mode.BRAKE]))
    until = world.now + HELD_FOR_S
    while world.now < until:
        world.copter.ack_after_s = chance.choice([0.003, 0.3, 0.7, 0.8, 1.0, 1.6, 2.4])
        world.copter.loses_acks = chance.random() < 0.2
        if chance.random() < 0.3:
            world.stalled_until = world.now + chance.choice([0.3, 0.8, 1.5])
        if chance.random() < 0.05:
            world.take()
        world.pass_time(chance.choice([0.1, 0.5, 1.0]))
    assert world.copter.height_m > HEIGHT_M / 2
    assert world.agent.hold.open
