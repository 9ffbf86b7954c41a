"""The interface through which a handler sends a file to the tower. No I/O."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Sending:
    """`done`: bytes sent. An interrupted attempt starts again at 0."""

    done: int


@dataclass(frozen=True, slots=True)
class Sent:
    """The tower has it."""


@dataclass(frozen=True, slots=True)
class NotSent:
    """The tower refuses the file. `why`: without a full stop."""

    why: str


class FileSender(Protocol):
    """Sends one file at a time, and retries until it is sent, refused, or stopped."""

    @property
    def state(self) -> Sending | Sent | NotSent:
        """Of the file begun last."""

    def begin(self, transaction_id: int, path: Path) -> None:
        """To `PUT /api/v1/agent/files/{transaction_id}`."""

    def stop(self) -> None:
        """Not any more. What is over stays as it is."""
