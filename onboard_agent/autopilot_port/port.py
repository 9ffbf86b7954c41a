"""What every autopilot port is. The rest of the agent knows only this."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable
from typing import Final

OnBytes = Callable[[bytes], None]
"""Is given what came in one read."""

MAX_BACKLOG_BYTES: Final = 16 * 1024
"""What may wait to be written to a stream: about a second at 115,200 baud. Older sticks than that would do harm."""


class AutopilotPort(ABC):
    """Bytes from and to the autopilot. Opens itself, and again whenever what it names comes back."""

    speaks_first: bool = False
    """Whether the autopilot cannot know of us until we have sent something."""
    narrow: bool = False
    """Whether the line has no spare capacity, so that it is better to request less than to discard more."""

    def __init__(self, name: str) -> None:
        self.name = name
        """As the user wrote it, for log lines."""
        self.counts: Counter[str] = Counter()
        """What was not passed on, by reason."""
        self.on_open: Callable[[], None] = lambda: None
        """Called each time a fresh stream of bytes begins, so that half a frame of the old one is forgotten."""

    @abstractmethod
    async def run(self, received: OnBytes) -> None:
        """Works until it is cancelled. Raises Unusable for what time does not cure."""

    @abstractmethod
    def send(self, data: bytes) -> None:
        """Writes whole frames at once, or drops and counts them. Never blocks, never raises."""
