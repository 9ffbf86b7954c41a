"""What the next agent process must know of a hold that is open, or of a drone flown by hand, if this one dies. No I/O.

The store brings it to the disk; here is what is kept, when it changes, and what a new process makes of it.
"""

from typing import Final, Protocol

import msgspec

from wire.control_messages import SafetySettings


class HoldStore(Protocol):
    """Where one record lasts. None of it waits: what was saved last is what a later process finds."""

    def load(self) -> bytes | None:
        """The record of the process before; None if it left none."""

    def save(self, record: bytes) -> None:
        """Begins to."""

    def remove(self) -> None:
        """Begins to."""

    def close(self) -> None:
        """Carries out what was begun."""


class NoHoldStore:
    """Nothing lasts."""

    def load(self) -> bytes | None:
        """Nothing."""
        return None

    def save(self, record: bytes) -> None:
        """Forgotten."""

    def remove(self) -> None:
        """There is none."""

    def close(self) -> None:
        """Nothing was begun."""


class HoldRecord(msgspec.Struct, frozen=True, kw_only=True):
    """`sticks`: sticks were in force when it was written, the agent's or a pilot's. `held`: the drone held."""

    system_id: int
    ground_station_system_id: int = 255
    sticks: bool
    held: bool
    why: str
    settings: SafetySettings


_encode: Final = msgspec.json.Encoder().encode
_decode: Final = msgspec.json.Decoder(HoldRecord).decode


class HoldMemory:
    """`left`: what the process before has left, once."""

    def __init__(self, store: HoldStore) -> None:
        self._store = store
        self._kept: HoldRecord | None = None
        self.left = self._load()

    def _load(self) -> HoldRecord | None:
        record = self._store.load()
        if record is None:
            return None
        try:
            return _decode(record)
        except (msgspec.DecodeError, UnicodeDecodeError):
            return None  # of another version: the autopilot's own failsafes have acted by now

    def keep(self, record: HoldRecord | None) -> None:
        """Call it at each tick; writes only what has changed. None: nothing that a new process must know."""
        if record == self._kept and (record is not None or self.left is None):
            return
        self._kept, self.left = record, None
        if record is None:
            self._store.remove()
        else:
            self._store.save(_encode(record))
