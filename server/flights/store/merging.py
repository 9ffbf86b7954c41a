"""Puts what a black box had into the telemetry log of a flight, in order of time and without copies. Blocking.

The frames themselves tell what the tower has already: a fetched frame that stands in the file nearby, byte for byte, is
the same one, and its two times show how the clocks of drone and tower differ. Doing it again changes nothing.
"""

from __future__ import annotations

import os
import statistics
import time
from collections import Counter, deque
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from server.flights.core.tlog import STAMP, Entry, read_entries
from server.flights.store.files import ENTRIES_A_TURN, TURN_S
from wire.dialect import mavlink
from wire.frames import message_id

SETUP_SIGNING: Final = mavlink.MAVLINK_MSG_ID_SETUP_SIGNING

CLOCKS_US: Final = 30_000_000
"""The clocks of drone and tower differ by less, after what is known of them."""
NEAR_US: Final = 2_000_000
"""A frame that is the same and this near is the same frame: at 128 frames a second its number is used again."""


def merge(tlog: Path, fetched: Path, *, shift_us: int, since_us: int, until_us: int) -> int:
    """Returns how many frames the log has got. `shift_us`: what added to the fetched times gives those of the log, as
    far as is known without looking. `since_us`, `until_us`: nothing else was asked for. Raises OSError."""
    wanted = [
        (one.at_us + shift_us, one.frame)
        for one in _entries(fetched)
        if message_id(one.frame) != SETUP_SIGNING  # it holds a key
    ]
    if not wanted:
        return 0
    begin_us, end_us = wanted[0][0] - CLOCKS_US, wanted[-1][0] + CLOCKS_US
    there: dict[bytes, deque[int]] = {}
    for one in _entries(tlog):
        if begin_us <= one.at_us <= end_us:
            there.setdefault(one.frame, deque()).append(one.at_us)
    correction_us = _correction_us(wanted, there)
    missing: list[tuple[int, bytes]] = []
    for at_us, frame in wanted:
        right_us = at_us + correction_us
        times = there.get(frame)
        while times and times[0] < right_us - NEAR_US:
            times.popleft()
        if times and times[0] <= right_us + NEAR_US:
            times.popleft()
        elif since_us <= right_us <= until_us:
            missing.append((right_us, frame))
    if missing:
        _write(tlog, missing)
    return len(missing)


def _correction_us(wanted: list[tuple[int, bytes]], there: dict[bytes, deque[int]]) -> int:
    """What the two clocks differ by, from frames that exist once."""
    counts = Counter(frame for _, frame in wanted)
    samples = [
        there[frame][0] - at_us
        for at_us, frame in wanted
        if counts[frame] == 1 and len(there.get(frame, ())) == 1 and abs(there[frame][0] - at_us) <= CLOCKS_US
    ]
    return round(statistics.median(samples)) if samples else 0


def _write(tlog: Path, missing: list[tuple[int, bytes]]) -> None:
    part = tlog.with_suffix(".merged.part")
    missing.sort(key=lambda one: one[0])
    rest = deque(missing)
    with part.open("wb") as file:
        os.fchmod(file.fileno(), 0o600)
        for one in _entries(tlog):
            while rest and rest[0][0] < one.at_us:
                at_us, frame = rest.popleft()
                file.write(STAMP.pack(at_us) + frame)
            file.write(STAMP.pack(one.at_us) + one.frame)
        for at_us, frame in rest:
            file.write(STAMP.pack(at_us) + frame)
        file.flush()
        os.fdatasync(file.fileno())
    part.replace(tlog)


def _entries(path: Path) -> Iterator[Entry]:
    """In turns: the tower's loop comes first."""
    if not path.exists():
        return
    with path.open("rb") as file:
        for number, entry in enumerate(read_entries(file)):
            yield entry
            if number % ENTRIES_A_TURN == ENTRIES_A_TURN - 1:
                time.sleep(TURN_S)


def resume_point(fetched: Path) -> int:
    """The time of the last fetched entry, which the next fetch begins with; 0: there is none. Entries of that time go:
    some of them may be missing. Raises OSError."""
    if not fetched.exists():
        return 0
    before = last_us = end = 0
    with fetched.open("rb") as file:
        for entry in read_entries(file):
            if entry.at_us != last_us:
                before, last_us = end, entry.at_us
            end = entry.end
    os.truncate(fetched, before)
    return last_us
