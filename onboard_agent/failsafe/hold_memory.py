"""Keeps what the next agent process must know of an open hold or a flight through the tower, if this one dies. No I/O.

The store writes it to the disk. This module defines what is kept and when it changes, and reads it in a new process.
"""

from typing import Final, Protocol

import msgspec

from wire.control_messages import SafetySettings


class HoldStore(Protocol):
    """Persists one record. `save` and `remove` do not wait; a later process finds the record that was saved last."""

    def load(self) -> bytes | None:
        """Returns the previous process's record; None if it left none."""

    def save(self, record: bytes) -> None:
        """Starts to save the record."""

    def remove(self) -> None:
        """Starts to remove the record."""

    def close(self) -> None:
        """Completes pending changes."""


class NoHoldStore:
    """Persists nothing."""

    def load(self) -> bytes | None:
        """Returns None."""
        return None

    def save(self, record: bytes) -> None:
        """Discards the record."""

    def remove(self) -> None:
        """Does nothing."""

    def close(self) -> None:
        """Does nothing."""


class HoldRecord(msgspec.Struct, frozen=True, kw_only=True):
    """`sticks`: sticks of the agent or a pilot were in force at the time of writing. `held`: the drone held. Neither:
    the tower had a part in this flight.

    `autopilot_kind`, `vehicle_type`: of its heartbeat; 0 in the record of an older version, which sends nothing until
    the vehicle is heard.
    """

    system_id: int
    autopilot_kind: int = 0
    vehicle_type: int = 0
    ground_station_system_id: int = 255
    sticks: bool
    held: bool
    why: str
    settings: SafetySettings


_encode: Final = msgspec.json.Encoder().encode
_decode: Final = msgspec.json.Decoder(HoldRecord).decode


class HoldMemory:
    """`left`: the previous process's record, until the first `keep`."""

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
            return None  # from another version: the autopilot's own failsafes have acted by now

    def keep(self, record: HoldRecord | None) -> None:
        """Call it at each tick; writes only changes. None: a new process needs to know nothing."""
        if record == self._kept and (record is not None or self.left is None):
            return
        self._kept, self.left = record, None
        if record is None:
            self._store.remove()
        else:
            self._store.save(_encode(record))
