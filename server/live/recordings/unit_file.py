"""What a recording is on disk while it goes on: units one after another, each with its length and a checksum. Pure.

Nothing is ever changed that was written before, so whatever happens to the tower, all but the last unit can be read.
Not the live picture's units alone, because a player knows nothing of when each was taken: docs/recordings.md.
"""

import zlib
from collections.abc import Iterator
from struct import Struct
from typing import IO, Final, NamedTuple

from wire.video import MAX_UNIT_BYTES, MalformedUnit, Unit, decode_unit

MAGIC: Final = b"TOWERREC1\n"
_ENTRY: Final = Struct("<IIQ")
ENTRY_BYTES: Final = _ENTRY.size


class NoRecording(ValueError):
    """The file does not begin as one."""


class Entry(NamedTuple):
    """One unit. `came_us`: when it came to the tower, by the same monotonic clock as its `capture_us`."""

    came_us: int
    unit: Unit


def entry_of(message: bytes, came_us: int) -> bytes:
    """What is appended for a unit."""
    return _ENTRY.pack(len(message), zlib.crc32(message), came_us) + message


def read_entries(file: IO[bytes]) -> Iterator[Entry]:
    """In the order in which they came, up to the end or to what is not whole any more. Raises NoRecording, OSError."""
    if file.read(len(MAGIC)) != MAGIC:
        raise NoRecording("this is no recording")
    while len(head := file.read(ENTRY_BYTES)) == ENTRY_BYTES:
        length, checksum, came_us = _ENTRY.unpack(head)
        if length > MAX_UNIT_BYTES:
            return
        message = file.read(length)
        if len(message) != length or zlib.crc32(message) != checksum:
            return
        try:
            yield Entry(came_us, decode_unit(message))
        except MalformedUnit:
            return
