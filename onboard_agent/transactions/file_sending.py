"""The interface for sending a file from a handler to the tower. No I/O."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Sending:
    """`done`: bytes sent. An attempt that broke off restarts at 0."""

    done: int


@dataclass(frozen=True, slots=True)
class Sent:
    """The tower has received the file."""


@dataclass(frozen=True, slots=True)
class NotSent:
    """The tower refused the file. `why`: without a full stop."""

    why: str


class FileSender(Protocol):
    """Sends one file at a time, and retries until it is sent, refused, or stopped."""

    @property
    def state(self) -> Sending | Sent | NotSent:
        """The state of the latest file."""

    def begin(self, transaction_id: int, path: Path) -> None:
        """Starts sending to `PUT /api/v1/agent/files/{transaction_id}`."""

    def stop(self) -> None:
        """Stops sending. A finished transfer keeps its state."""
