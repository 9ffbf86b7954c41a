"""The built-in controller `scripted`: takes off, flies a square in four legs, and lands. It shows that all is well."""

from collections.abc import Iterator
from typing import Final

from onboard_agent.autonomy.controller import Controller, Direction, DirectionState, GoBy, Land, Seen, TakeOff, Turn

HEIGHT_M: Final = 6.0
LEG_M: Final = 8.0
SPEED_M_S: Final = 3.0
LEGS: Final = 4


class ScriptFailed(Exception):
    """A direction of the script was not carried out."""


class Scripted(Controller):
    """Gives the next direction when the one before is done."""

    described_settings = ()

    def __init__(self) -> None:
        self._script: Iterator[Direction] | None = None
        self._given = 0

    def step(self, seen: Seen) -> Direction | None:
        """Returns the next direction of the script."""
        if self._script is None:
            self._script = _script(airborne=seen.airborne)
        if seen.number == self._given and seen.state in (DirectionState.REFUSED, DirectionState.EXPIRED):
            raise ScriptFailed(f"direction {seen.number} was {seen.state}: {seen.words}")
        if seen.number < self._given or seen.state is DirectionState.FLYING:
            return None
        direction = next(self._script, None)
        self._given += direction is not None
        return direction


def _script(*, airborne: bool) -> Iterator[Direction]:
    if not airborne:
        yield TakeOff(HEIGHT_M)
    for _ in range(LEGS):
        yield GoBy(forward_m=LEG_M, speed_m_s=SPEED_M_S)
        yield Turn(90.0)
    yield Land()
