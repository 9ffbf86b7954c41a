"""A parameter value that an autopilot needs to fly without a radio receiver, and why. Pure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class WantedParameter:
    """`value`: returns the wanted value for the present one. `why`: a sentence for people."""

    name: str
    value: Callable[[float], float]
    why: str


def with_bits(bits: int) -> Callable[[float], float]:
    """For a set of flags: these besides the present ones."""
    return lambda now: float(int(now) | bits)
