"""While an admin assists: whose frames pass. No I/O; takes `now`.

The turn changes with the epoch, which the database has to give out first. In between nobody's frames pass; the
assistant's first few wait, so that a single command is not lost.
"""

from typing import Final, Literal

Whose = Literal["holder", "assistant"]

BACK_AFTER_S: Final = 1.0
"""The holder's frames pass again so long after the last one of the assistant."""

MAX_WAITING: Final = 16
WAIT_AT_MOST_S: Final = 1.0
"""A command that could not pass by then is not executed late."""


class AssistTurn:
    """One for each drone; means something only while there is an assistant."""

    def __init__(self) -> None:
        self.whose: Whose = "holder"
        self.wanted: Whose = "holder"
        self._last_at = float("-inf")
        self._waiting: list[tuple[float, bytes]] = []

    def reset(self) -> None:
        """Nobody assists (any more)."""
        self.whose = self.wanted = "holder"
        self._waiting.clear()

    def assistant_frame(self, frame: bytes, now: float) -> bool:
        """A frame of the assistant: True if it may pass now. Otherwise it waits for the turn to change."""
        self._last_at = now
        if self.whose == self.wanted == "assistant":
            return True
        self.wanted = "assistant"
        if len(self._waiting) < MAX_WAITING:
            self._waiting.append((now, frame))
        return False

    def asks(self, now: float) -> bool:
        """The assistant wants something that is no frame: True if it may be done now. Again while it is being done: the
        turn goes back when they have been silent."""
        self._last_at = now
        self.wanted = "assistant"
        return self.whose == "assistant"

    def over(self, now: float) -> bool:
        """True once, when the assistant has been silent for long enough: the turn is to go back."""
        if self.wanted == "assistant" and now - self._last_at >= BACK_AFTER_S:
            self.wanted = "holder"
            return True
        return False

    def changed(self, now: float) -> list[bytes]:
        """The new epoch is there: the turn is what was wanted. Returns the frames that waited and are not too old."""
        self.whose = self.wanted
        waiting, self._waiting = self._waiting, []
        if self.whose != "assistant":
            return []
        return [frame for since, frame in waiting if now - since <= WAIT_AT_MOST_S]
