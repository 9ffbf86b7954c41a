"""The interface for fetching a package from the tower. No I/O."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Fetching:
    """`done` of `total` bytes have come."""

    done: int
    total: int


@dataclass(frozen=True, slots=True)
class Fetched:
    """The whole package is here, verified and unpacked."""


@dataclass(frozen=True, slots=True)
class NotFetched:
    """`why`: without a full stop."""

    why: str


class UpdateInstaller(Protocol):
    """Fetches, verifies and unpacks one release at a time, in a thread."""

    @property
    def state(self) -> Fetching | Fetched | NotFetched:
        """Of the latest release."""

    @property
    def release_keys(self) -> tuple[str, ...]:
        """Those that may sign."""

    def begin(self, version: str) -> None:
        """Fetches `GET /api/v1/agent/releases/{version}`."""

    def stop(self) -> None:
        """Gives up."""

    def switch(self, version: str, transaction_id: int) -> None:
        """The unpacked release runs from the next start on, which comes at once. Raises OSError."""

    def pop_outcome(self) -> tuple[int, bool, str] | None:
        """How the last update ended, once: the transaction, whether the new release runs, and the words for it."""
