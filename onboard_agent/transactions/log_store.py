"""The interface of the store for a flight log on its way from autopilot to tower. No I/O."""

from pathlib import Path
from typing import Protocol

from wire.transactions import LogEntry


class LogStore(Protocol):
    """Storage for one log."""

    def open(self, log: LogEntry) -> int:
        """Returns the bytes already stored; deletes any other log. Raises OSError, with a text if there is no room."""

    def append(self, data: bytes) -> None:
        """Raises OSError."""

    def read(self, offset: int, count: int) -> bytes:
        """Returns bytes of the log opened last. Raises OSError."""

    @property
    def path(self) -> Path:
        """Path of the log opened last."""

    def remove(self) -> None:
        """Deletes the log opened last."""
