"""Decides whose frames pass while an admin assists. No I/O; takes `now`.

The turn changes with the epoch, which the database assigns first. Until then no frames pass; the first few of the
assistant wait, so that a single command is not lost.
"""

from typing import Final, Literal

Whose = Literal["holder", "assistant"]

BACK_AFTER_S: Final = 1.0
"""The holder's frames pass again this long after the assistant's last frame."""

MAX_WAITING: Final = 16
MAX_WAIT_S: Final = 1.0
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
        """The assistant requests something that is not a frame. True if it may start now. Call it again while it runs:
        the turn goes back after their silence."""
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
        """The new epoch has arrived: the turn is the requested one. Returns the waiting frames that are not too old."""
        self.whose = self.wanted
        waiting, self._waiting = self._waiting, []
        if self.whose != "assistant":
            return []
        return [frame for since, frame in waiting if now - since <= MAX_WAIT_S]
