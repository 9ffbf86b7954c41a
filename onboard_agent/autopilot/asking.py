"""Asks one question after another, each until it is answered or given up. No I/O.

One at a time because serial lines are slow and autopilots drop commands that come in a burst.
"""

from collections import deque
from collections.abc import Iterable
from typing import Generic, TypeVar

Question = TypeVar("Question")


class Asking(Generic[Question]):
    """Call `ask` with a request, send what `due` returns, and report the answer with `answered`."""

    def __init__(self, *, timeout_s: float, tries: int) -> None:
        self._timeout_s = timeout_s
        self._tries = tries
        self._open: deque[Question] = deque()
        self._asked = 0
        self._again_at = 0.0

    def ask(self, questions: Iterable[Question]) -> None:
        """These, in this order, instead of whatever was still open."""
        self._open = deque(questions)
        self._asked = 0

    @property
    def current(self) -> Question | None:
        """The request that waits to be sent or answered; None when all are answered."""
        return self._open[0] if self._open else None

    def due(self, now: float) -> tuple[Question, int] | None:
        """A request to send now, and how often it was sent before."""
        if self._asked and now < self._again_at:
            return None
        if self._asked >= self._tries:
            self.answered()
        if not self._open:
            return None
        asked = self._asked
        self._asked += 1
        self._again_at = now + self._timeout_s
        return self._open[0], asked

    def answered(self) -> None:
        """The current question is done with."""
        self._open.popleft()
        self._asked = 0

    def wait_longer(self, now: float, for_s: float) -> None:
        """The other side is at it: the time-out begins again, with this length."""
        self._again_at = now + for_s
