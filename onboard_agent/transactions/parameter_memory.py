"""The parameter table that the agent remembers across restarts. No I/O.

A record belongs to one autopilot, identified by its chip number (AUTOPILOT_VERSION) or, without one, by system id and
kind. It is a cache: an unreadable or incomplete record counts as none.
"""

from typing import Final, Protocol

import msgspec

from wire.dialect import mavlink
from wire.parameters import MAX_ENTRIES, Table, pack_table, unpack_table
from wire.transactions import MAX_PACKED_TABLE_BYTES

MAX_RECORD_BYTES: Final = 2 * MAX_PACKED_TABLE_BYTES


class ParameterStore(Protocol):
    """One record for each autopilot. May fail silently; then nothing is remembered."""

    def load(self, autopilot: str) -> bytes | None:
        """Returns the record, or None. `autopilot`: letters, digits and hyphens."""

    def save(self, autopilot: str, record: bytes) -> None:
        """Replaces the previous record."""


class Remembered(msgspec.Struct, frozen=True):
    """The last known table. `count`: as the autopilot counts. `autopilot_hash`: PX4's hash of the table."""

    table: Table
    count: int
    autopilot_hash: bytes | None = None


class _Record(msgspec.Struct, frozen=True):
    packed: bytes
    count: int
    autopilot_hash: bytes | None


_decoder: Final = msgspec.json.Decoder(_Record)


def chip_name(version: object) -> str | None:
    """The name of an autopilot from its AUTOPILOT_VERSION; None if that does not identify the chip."""
    uid2 = bytes(getattr(version, "uid2", b"") or b"")
    if any(uid2):
        return f"chip-{uid2.hex()}"
    uid = int(getattr(version, "uid", 0))
    return f"chip-{uid:016x}" if uid else None


def place_name(*, system_id: int, autopilot_kind: int) -> str:
    """The name of an autopilot that does not report its chip."""
    kind = mavlink.enums["MAV_AUTOPILOT"].get(autopilot_kind)
    name = str(autopilot_kind) if kind is None else str(kind.name).removeprefix("MAV_AUTOPILOT_").lower()
    return f"{name.replace('_', '-')}-{system_id}"


def remember(store: ParameterStore, autopilot: str, what: Remembered) -> None:
    """Saves the table."""
    record = _Record(pack_table(what.table), what.count, what.autopilot_hash)
    store.save(autopilot, msgspec.json.encode(record))


def recall(store: ParameterStore, autopilot: str) -> Remembered | None:
    """Returns the saved table if it is complete."""
    saved = store.load(autopilot)
    if saved is None or len(saved) > MAX_RECORD_BYTES:
        return None
    try:
        record = _decoder.decode(saved)
        table = unpack_table(record.packed)
    except (msgspec.DecodeError, ValueError, RecursionError):
        return None
    if not table or not 0 < record.count <= MAX_ENTRIES:
        return None
    return Remembered(table, record.count, record.autopilot_hash)
