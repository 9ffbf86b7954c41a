"""How long to wait for an answer, and how often to repeat the request. No I/O; takes `now`."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RetryPolicy:
    """Times in seconds, and a number of tries. The defaults suit a line on which an answer takes milliseconds."""

    first_s: float = 1.5
    """Timeout for the first answer: an autopilot may have to search for it."""
    next_s: float = 0.25
    """Timeout for each further item."""
    tries: int = 5
    silence_s: float = 3.0
    """An autopilot that receives a plan repeats its request after a second: after this silence it has given up."""
    busy_s: float = 10.0
    """An autopilot that still waits for the rest of an upload denies everything else for 8 s."""


class Repeated:
    """One request at a time, repeated until it is answered or given up."""

    def __init__(self, tries: int) -> None:
        self._tries = tries
        self._question: bytes | None = None
        self._wait_s = 0.0
        self._asked = 0
        self._again_at = 0.0

    def ask(self, question: bytes, wait_s: float) -> None:
        """Sets the request, with a wait of `wait_s` before each retry."""
        self._question, self._wait_s, self._asked = question, wait_s, 0

    def postpone(self, now: float) -> None:
        """Delays the request by its wait, even the first time."""
        self._asked, self._again_at = 1, now + self._wait_s

    def answered(self) -> None:
        """Ends the retries."""
        self._question = None

    def due(self, now: float) -> bytes | None:
        """Returns the request if it is due now."""
        if self._question is None or (self._asked and now < self._again_at) or self._asked >= self._tries:
            return None
        self._asked += 1
        self._again_at = now + self._wait_s
        return self._question

    def given_up(self, now: float) -> bool:
        """Whether the last try has timed out."""
        return self._question is not None and self._asked >= self._tries and now >= self._again_at
