"""Flights of a simulated copter that end in a hold."""

from typing import Any

from worlds.held_copter import HeldCopter
from worlds.model_copter import Mode, ModelCopter, Receiver

STEP_S = 0.05
STAYS_IN_GUIDED = {"FS_OPTIONS": 20.0}
NO_FAILSAFE = {"FS_THR_ENABLE": 0.0}


def flown(
    receiver: Receiver = Receiver.LOW,
    *,
    parameters: dict[str, float] | None = None,
    mode: Mode = Mode.LOITER,
    hand: tuple[int, int] | None = (600, 500),
    height_m: float = 20.0,
    **settings: Any,
) -> HeldCopter:
    """A flight by hand; the agent has read what it needs to know."""
    copter = ModelCopter(50.0, receiver=receiver, parameters=parameters, height_m=height_m, mode=mode)
    world = HeldCopter(copter, step_s=STEP_S, knows_s=0.0, **settings)
    world.hand = hand
    world.pass_time(3.0)
    return world


def taken(receiver: Receiver = Receiver.LOW, *, after_s: float = 5.0, **how: Any) -> HeldCopter:
    world = flown(receiver, **how)
    world.take()
    world.pass_time(after_s)
    return world


def sinks(world: HeldCopter, height_m: float) -> bool:
    return world.copter.height_m < height_m - 1.0
