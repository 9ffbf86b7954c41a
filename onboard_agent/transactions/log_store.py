"""The interface of the store for a flight log between autopilot and tower. No I/O."""

from pathlib import Path
from typing import Protocol

from wire.transactions import LogEntry


class LogStore(Protocol):
    """Room for one log."""

    def open(self, log: LogEntry) -> int:
        """Bytes of it that are there already; any other log goes. Raises OSError, with words where it has no room."""

    def append(self, data: bytes) -> None:
        """Raises OSError."""

    @property
    def path(self) -> Path:
        """Of the log opened last."""

    def remove(self) -> None:
        """The log that was opened last is not needed any more."""
