"""Remembers which hold steps an agent has reported, so that people see each once. No I/O.

A step arrives on two channels, sometimes repeatedly, and again on the next link if it was sent while the control
channel was gone.
"""

from collections import deque
from typing import Final

from wire.control_messages import HoldProgress

MAX_REMEMBERED: Final = 64
"""Twice what an agent keeps to tell it again."""


class HoldSteps:
    """For one drone, as long as the tower knows it."""

    def __init__(self) -> None:
        self._received: deque[HoldProgress] = deque(maxlen=MAX_REMEMBERED)
        self._newest = 0

    def link_ended(self) -> None:
        """What comes next may be from another process, which counts again."""
        self._newest = 0

    def is_news(self, progress: HoldProgress) -> bool:
        """Whether this step is new.

        Copies are equal in all fields; two similar holds of one epoch differ in `number`, which each agent process
        assigns. An intermediate step that a later one of the same link overtook is not new; the end of a hold always
        is.
        """
        overtaken = 0 < progress.number < self._newest and not progress.step.final
        if overtaken or progress in self._received:
            return False
        self._received.append(progress)
        self._newest = max(self._newest, progress.number)
        return True
