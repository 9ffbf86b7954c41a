"""The telemetry log (`.tlog`) of Mission Planner, MAVProxy and pymavlink: each frame behind the time at which it passed
the tower, in microseconds since 1970, 8 bytes, big endian. Pure.

Nothing else may go into such a file: programs of others read it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from struct import Struct
from typing import IO, Final, NamedTuple

from wire.dialect import mavlink
from wire.frames import MAX_FRAME_BYTES, MalformedFrame, frame_length, source
from wire.own_system import OwnSystem

STAMP: Final = Struct(">Q")
STAMP_BYTES: Final = STAMP.size
MAX_ENTRY_BYTES: Final = STAMP_BYTES + MAX_FRAME_BYTES
_PIECE: Final = 64 * 1024


class Entry(NamedTuple):
    """One frame. `at_us`: microseconds since 1970; `end`: where the next entry begins in the file."""

    at_us: int
    frame: bytes
    end: int


def read_entries(file: IO[bytes], *, begin: int = 0) -> Iterator[Entry]:
    """Yields the entries from there on, up to the end or to what is not whole. Raises OSError."""
    file.seek(begin)
    buffer, at, end = b"", 0, begin
    while True:
        if len(buffer) - at < MAX_ENTRY_BYTES:
            buffer = buffer[at:] + file.read(_PIECE)
            at = 0
        try:
            length = frame_length(buffer, at + STAMP_BYTES) if len(buffer) - at > STAMP_BYTES else 0
        except MalformedFrame:
            return
        after = at + STAMP_BYTES + length
        if not length or after > len(buffer):
            return
        end += after - at
        (at_us,) = STAMP.unpack_from(buffer, at)
        yield Entry(at_us, buffer[at + STAMP_BYTES : after], end)
        at = after


def of_one_vehicle(entries: Iterable[Entry]) -> Iterator[Entry]:
    """Leaves out the frames of other vehicles: older agents and other programs recorded whatever was on a shared line.
    What ground stations sent stays."""
    own = OwnSystem(judged=True)
    for entry in entries:
        if is_of_one_vehicle(own, entry.frame, entry.at_us):
            yield entry


def is_of_one_vehicle(own: OwnSystem, frame: bytes, at_us: int) -> bool:
    """For one frame after the other of a recording."""
    return own.counts(frame, at_us / 1e6) or source(frame)[1] != mavlink.MAV_COMP_ID_AUTOPILOT1
