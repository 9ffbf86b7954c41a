"""The interface of every autopilot port. The rest of the agent knows only this."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable
from typing import Final

OnBytes = Callable[[bytes], None]
"""Receives the bytes of one read."""

MAX_BACKLOG_BYTES: Final = 16 * 1024
"""Maximum bytes that wait to be written to a stream: about a second at 115,200 baud. Older sticks would do harm."""


class AutopilotPort(ABC):
    """Bytes from and to the autopilot. Opens itself, and opens again whenever the device or peer returns."""

    speaks_first: bool = False
    """Whether the autopilot does not know the agent's address until the agent has sent something."""
    narrow: bool = False
    """Whether the line has no bandwidth to spare, so that requesting less is better than discarding it later."""

    def __init__(self, name: str) -> None:
        self.name = name
        """The port as the user wrote it, for log lines."""
        self.counts: Counter[str] = Counter()
        """Dropped data, by reason."""
        self.on_open: Callable[[], None] = lambda: None
        """Called each time a new stream of bytes begins, so that half a frame of the old one is discarded."""

    @abstractmethod
    async def run(self, received: OnBytes) -> None:
        """Runs until cancelled. Raises Unusable for errors that do not pass with time."""

    @abstractmethod
    def send(self, data: bytes) -> None:
        """Writes whole frames at once, or drops and counts them. Never blocks, never raises."""
