"""The journal on disk while a plan is being written, so that the old plan survives a crash. No I/O.

An intent is saved before the first frame of a write, and removed when a read-back has proved which plan is on board.
While an intent exists, the plan on board may be incomplete.
"""

from collections.abc import Callable
from typing import Final, Protocol

import msgspec

from wire.plans import BoundedPlan, Plan, PlanKind

Lasting = Callable[[], bool]
"""Returns whether the change is done and durable. Raises OSError if it failed; then nothing has changed."""


class JournalStore(Protocol):
    """One record for each kind of plan. Changes are atomic and applied in the order of the calls.

    A call that returns None is already durable; otherwise the change is durable once the Lasting returns True.
    """

    def load(self, kind: PlanKind) -> bytes | None:
        """Returns the record, or None if there is none. Raises OSError."""

    def save(self, kind: PlanKind, record: bytes) -> Lasting | None:
        """Raises OSError; then nothing has changed."""

    def remove(self, kind: PlanKind) -> Lasting | None:
        """Deletes the record. Raises OSError."""


class NoJournal:
    """A JournalStore without storage: it has no records and accepts none."""

    def load(self, kind: PlanKind) -> bytes | None:
        """Returns None."""
        return None

    def save(self, kind: PlanKind, record: bytes) -> None:
        """Raises OSError."""
        raise OSError("it has no directory for its state")

    def remove(self, kind: PlanKind) -> None:
        """Does nothing."""


class Intent(msgspec.Struct, frozen=True):
    """The plan that was on board, and the plan that replaces it."""

    old: BoundedPlan
    new: BoundedPlan


UNREADABLE: Final = Intent((), ())
"""Replaces an unreadable record: the plan on board is unknown, and no plan is better than half a plan."""

_decoder: Final[msgspec.json.Decoder[Intent]] = msgspec.json.Decoder(Intent)


def write_intent(store: JournalStore, kind: PlanKind, *, old: Plan, new: Plan) -> Lasting | None:
    """Raises OSError."""
    return store.save(kind, msgspec.json.encode(Intent(old, new)))


def read_intent(store: JournalStore, kind: PlanKind) -> Intent | None:
    """Returns None if no write was in progress; UNREADABLE if the record cannot be read."""
    try:
        record = store.load(kind)
    except OSError:
        return UNREADABLE
    if record is None:
        return None
    try:
        return _decoder.decode(record)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return UNREADABLE
