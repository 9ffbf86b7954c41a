"""Which steps of holds a drone's agent has told already. No I/O.

A step comes on two channels, more than once on one of them, and again on the next link, if it was told while the agent
had no control channel and the link ended like that. People are told of it once.
"""

from collections import deque
from typing import Final

from wire.control_messages import HoldProgress

MAX_REMEMBERED: Final = 64
"""Twice what an agent keeps to tell it again."""


class HoldSteps:
    """Of one drone, for as long as the tower knows it."""

    def __init__(self) -> None:
        self._received: deque[HoldProgress] = deque(maxlen=MAX_REMEMBERED)
        self._newest = 0

    def link_ended(self) -> None:
        """What comes next may be from another process, which counts again."""
        self._newest = 0

    def is_news(self, progress: HoldProgress) -> bool:
        """Whether this step was not told before.

        Copies are equal in everything; two holds of one epoch that went alike still differ in `number`, of which each
        agent process has its own. A step between that was overtaken by a later one of the same link is no news any
        more; how a hold ended always is.
        """
        overtaken = 0 < progress.number < self._newest and not progress.step.final
        if overtaken or progress in self._received:
            return False
        self._received.append(progress)
        self._newest = max(self._newest, progress.number)
        return True
