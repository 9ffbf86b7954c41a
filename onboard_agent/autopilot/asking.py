"""Sends requests one after another, each until it is answered or given up. No I/O.

One at a time, because serial lines are slow and autopilots drop commands that arrive in a burst.
"""

from collections import deque
from collections.abc import Iterable
from typing import Generic, TypeVar

Question = TypeVar("Question")


class Asking(Generic[Question]):
    """Queue questions with `ask`, send what `due` returns, and report the answer with `answered`."""

    def __init__(self, *, timeout_s: float, tries: int) -> None:
        self._timeout_s = timeout_s
        self._tries = tries
        self._open: deque[Question] = deque()
        self._asked = 0
        self._again_at = 0.0

    def ask(self, questions: Iterable[Question]) -> None:
        """Queues these questions in this order, in place of those still open."""
        self._open = deque(questions)
        self._asked = 0

    @property
    def current(self) -> Question | None:
        """The question that waits to be sent or answered; None if there is none."""
        return self._open[0] if self._open else None

    def due(self, now: float) -> tuple[Question, int] | None:
        """Returns a question to ask now and how often it was asked before, or None."""
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
        """Removes the current question: it was answered or given up."""
        self._open.popleft()
        self._asked = 0

    def wait_longer(self, now: float, for_s: float) -> None:
        """Restarts the timeout with this length, because the other side is working on the answer."""
        self._again_at = now + for_s
