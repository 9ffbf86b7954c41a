"""The journal that is on disk while a plan is being written, so the old plan survives a crash. No I/O.

An intent is saved before the first frame of a write and removed when a read-back has proved which plan is on board.
While an intent exists, the plan on board may be incomplete.
"""

from collections.abc import Callable
from typing import Final, Protocol

import msgspec

from wire.plans import BoundedPlan, Plan, PlanKind

Lasting = Callable[[], bool]
"""Ask it: whether what was to be done is done, and lasts. Raises OSError where it cannot be; then nothing changed."""


class JournalStore(Protocol):
    """One record for each kind of plan. Each change is atomic, in the order of the calls. A call that returns None is
    done and durable; otherwise the returned Lasting says when."""

    def load(self, kind: PlanKind) -> bytes | None:
        """The record, or None without one. Raises OSError."""

    def save(self, kind: PlanKind, record: bytes) -> Lasting | None:
        """Raises OSError; then nothing has changed."""

    def remove(self, kind: PlanKind) -> Lasting | None:
        """No record any more. Raises OSError."""


class NoJournal:
    """A JournalStore where there is no place for one: nothing was ever begun, and nothing is."""

    def load(self, kind: PlanKind) -> bytes | None:
        """There is none."""
        return None

    def save(self, kind: PlanKind, record: bytes) -> None:
        """Raises OSError."""
        raise OSError("it has no directory for its state")

    def remove(self, kind: PlanKind) -> None:
        """There is none."""


class Intent(msgspec.Struct, frozen=True):
    """The plan that was on board, and the one that is to be."""

    old: BoundedPlan
    new: BoundedPlan


UNREADABLE: Final = Intent((), ())
"""Stands for an unreadable record: the plan on board was not known, and no plan is better than half a plan."""

_decoder: Final[msgspec.json.Decoder[Intent]] = msgspec.json.Decoder(Intent)


def write_intent(store: JournalStore, kind: PlanKind, *, old: Plan, new: Plan) -> Lasting | None:
    """Raises OSError."""
    return store.save(kind, msgspec.json.encode(Intent(old, new)))


def read_intent(store: JournalStore, kind: PlanKind) -> Intent | None:
    """None if nothing was being written; UNREADABLE if what was is not known."""
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
