"""The units of a recording: their file, their content, and the display time of each picture. Pure.

- The file has one unit after another, each with its length and a checksum. Written bytes never change, so after any
  failure all but the last unit can be read. The live units alone do not suffice, because a player would not know when
  each was taken: docs/recordings.md.
- H.264: checks whether the parameter sets of the first picture decode the whole recording.
- MPEG-1: a unit has one captured picture, and may have another one that says "unchanged": this makes the encoder output
  the first one without delay.
- The interval between displayed pictures is the interval between their captures.
"""

from __future__ import annotations

import itertools
import re
import zlib
from collections.abc import Iterator, Sequence
from itertools import pairwise
from statistics import median
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


_START_CODE: Final = re.compile(rb"\x00\x00\x01")
_SEQUENCE_SET: Final = 7
_PICTURE_SET: Final = 8


def parameter_sets(payload: bytes) -> tuple[bytes, ...]:
    """The sequence and picture parameter sets of an access unit in Annex B, in order, without start codes."""
    starts = [found.end() for found in _START_CODE.finditer(payload)]
    found: list[bytes] = []
    for start, following in pairwise([*starts, len(payload) + 3]):
        if start < len(payload) and payload[start] & 0x1F in (_SEQUENCE_SET, _PICTURE_SET):
            found.append(payload[start : following - 3].rstrip(b"\x00"))
    return tuple(found)


TICKS_PER_S: Final = 90_000
"""The unit of time in the finished file."""
_MIN_STEP: Final = 90
"""A millisecond: two pictures never share a time, whatever the clocks say."""


class Taken(NamedTuple):
    """Microseconds of one monotonic clock. `capture_us`: 0 if not known; `came_us`: arrival at the tower."""

    capture_us: int
    came_us: int
    rate_hz: float


MAX_LAG_US: Final = 30_000_000


class Shown(NamedTuple):
    """In ticks from the beginning of the file."""

    at: int
    lasts: int


def taken_us(one: Taken) -> int:
    """When the picture was taken; when it came, if the time of capture is not known or not to be believed."""
    return one.capture_us if _is_believed(one) else one.came_us


def shown_times(taken: Sequence[Taken]) -> list[Shown]:
    """One for each picture. A picture stays until the next one, also through a pause; the last stays for one period.

    Where the time of capture is not known it is guessed from when the picture came, by the least delay that was seen.
    A time that lies before that of an earlier picture, or further off than any network explains, is not believed.
    """
    if not taken:
        return []
    lag_us = _least_lag(taken)
    moments = [_moment(one, lag_us) for one in taken]
    first = moments[0]
    at: list[int] = []
    for moment in moments:
        ticks = round((moment - first) * TICKS_PER_S / 1_000_000)
        at.append(ticks if not at else max(ticks, at[-1] + _MIN_STEP))
    steps = [later - earlier for earlier, later in itertools.pairwise(at)]
    period = round(TICKS_PER_S / taken[-1].rate_hz)
    # The rate is the encoder's target; the received pictures are more exact, unless there was a pause.
    last = min(period, round(median(steps[-30:]))) if steps else period
    return [Shown(moment, step) for moment, step in zip(at, [*steps, max(_MIN_STEP, last)], strict=True)]


def first_lag_us(taken: Sequence[Taken]) -> int:
    """By how much the file begins before `taken_us` of its first picture: 0 where the time of capture is known.
    `taken`: at least one."""
    return taken_us(taken[0]) - _moment(taken[0], _least_lag(taken))


def _least_lag(taken: Sequence[Taken]) -> int:
    lags = [one.came_us - one.capture_us for one in taken if one.capture_us]
    return min((lag for lag in lags if 0 <= lag <= MAX_LAG_US), default=0)


def _moment(one: Taken, lag_us: int) -> int:
    return one.capture_us if _is_believed(one) else one.came_us - lag_us


def _is_believed(one: Taken) -> bool:
    return one.capture_us != 0 and -1_000_000 <= one.came_us - one.capture_us <= MAX_LAG_US
