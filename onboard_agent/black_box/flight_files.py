"""The folder of the black box: for each flight a `.tlog`, its index `.jsonl` and its table `.csv`. Blocking.

The index has one JSON object a line: `flight` (when it began), `at` (times and where they begin in the `.tlog`, about
one a second), `end`. It is written after the frames that it names. A flight without `end` was cut off by a crash.
"""

import os
import re
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import msgspec

from onboard_agent.black_box.csv_rows import HEADER, CsvRows, clock_offset_us
from wire.black_box import MAX_FLIGHTS, MAX_PIECE_BYTES, BlackBoxFlight
from wire.frames import MalformedFrame, frame_length

LEFT_FREE_BYTES: Final = 200 * 1000 * 1000
"""For everything else on the card."""
MAX_ENTRY_BYTES: Final = 8 + 280
_READ_BYTES: Final = 64 * 1024
ENTRIES_A_TURN: Final = 200
TURN_S: Final = 0.002
"""The agent's loop comes first: a table is made in pieces of about a millisecond."""
TLOG: Final = ".tlog"
INDEX: Final = ".jsonl"
CSV: Final = ".csv"
_PART: Final = ".csv.part"
_NAME: Final = re.compile(r"[0-9]{8}T[0-9]{6}-[0-9a-f]{4}")
_encoder: Final = msgspec.json.Encoder()
_decoder: Final = msgspec.json.Decoder()


class NoFlight(Exception):
    """It is not on the disk, or not any more."""


@dataclass
class _Times:
    """`marks`: times and where they begin in the `.tlog`."""

    began_us: int = 0
    ended_us: int | None = None
    marks: list[tuple[int, int]] = field(default_factory=list)


def entries_in(path: Path, begin: int = 0) -> Iterator[tuple[int, bytes, int]]:
    """Yields (time, frame, where the next entry begins) up to the end, or to what is not whole. Raises OSError."""
    with path.open("rb") as file:
        file.seek(begin)
        buffer, at, end = b"", 0, begin
        while True:
            if len(buffer) - at < MAX_ENTRY_BYTES:
                buffer, at = buffer[at:] + file.read(_READ_BYTES), 0
            try:
                length = frame_length(buffer, at + 8) if len(buffer) - at > 8 else 0
            except MalformedFrame:
                return
            after = at + 8 + length
            if not length or after > len(buffer):
                return
            end += after - at
            yield int.from_bytes(buffer[at : at + 8]), buffer[at + 8 : after], end
            at = after


class FlightFiles:
    """`budget_bytes`: of all flights together; the oldest make room."""

    def __init__(self, folder: Path, budget_bytes: int) -> None:
        self.folder = folder
        self._budget_bytes = budget_bytes

    def names(self) -> list[str]:
        """All flights, oldest first. Raises OSError."""
        stems = {path.name.partition(".")[0] for path in self.folder.iterdir()} if self.folder.exists() else set()
        return sorted(stem for stem in stems if _NAME.fullmatch(stem))

    def path(self, name: str, ending: str) -> Path:
        """Where a file of a flight is. Raises NoFlight for what is no name."""
        if not _NAME.fullmatch(name):
            raise NoFlight
        return self.folder / f"{name}{ending}"

    def make_room(self, current: str = "") -> bool:
        """Removes the oldest flights but this one until the rest fits. Whether it does. Raises OSError."""
        names = [name for name in self.names() if name != current]
        sizes = {name: self._size(name) for name in (*names, current) if name}
        total = sum(sizes.values())
        while total > self._budget_bytes or shutil.disk_usage(self.folder).free < LEFT_FREE_BYTES:
            if not names:
                return False
            oldest = names.pop(0)
            for ending in (TLOG, INDEX, CSV, _PART):
                self.path(oldest, ending).unlink(missing_ok=True)
            total -= sizes[oldest]
        return True

    def _size(self, name: str) -> int:
        total = 0
        for ending in (TLOG, INDEX, CSV, _PART):
            path = self.path(name, ending)
            total += path.stat().st_size if path.exists() else 0
        return total

    def newest(self) -> tuple[BlackBoxFlight, ...]:
        """Those that the tower is told of, oldest first. Raises OSError."""
        flights = []
        for name in self.names()[-MAX_FLIGHTS:]:
            times = self._times(name)
            if times.began_us:
                flights.append(BlackBoxFlight(name=name, began_us=times.began_us, ended_us=times.ended_us))
        return tuple(flights)

    def unfinished(self, current: str = "") -> list[str]:
        """Flights that a crash cut off, or that have no table yet, oldest first. Raises OSError."""
        names = [name for name in self.names() if name != current]
        return [name for name in names if self._times(name).ended_us is None or not self.path(name, CSV).exists()]

    def complete(self, name: str, stop: Callable[[], bool]) -> bool:
        """After the end of a flight: cuts off what is not whole and makes the table. Whether it came to its end before
        `stop` was true. Raises OSError."""
        if self._times(name).ended_us is None and not self._cut(name, stop):
            return False
        return self._make_table(name, stop)

    def _cut(self, name: str, stop: Callable[[], bool]) -> bool:
        tlog, index = self.path(name, TLOG), self.path(name, INDEX)
        whole = last_us = began_us = 0
        if tlog.exists():
            for number, (at_us, _frame, end) in enumerate(entries_in(tlog)):
                began_us, last_us, whole = began_us or at_us, at_us, end
                if number % ENTRIES_A_TURN == ENTRIES_A_TURN - 1:
                    if stop():
                        return False
                    time.sleep(TURN_S)
            os.truncate(tlog, whole)
        content = index.read_bytes() if index.exists() else b""
        lines = [line for line in content.split(b"\n")[:-1] if _object(line)]
        lines = lines or [index_line("flight", began_us)[:-1]]
        lines.append(index_line("end", last_us, words="the agent ended while it was recorded")[:-1])
        index.write_bytes(b"\n".join(lines) + b"\n")
        return True

    def _make_table(self, name: str, stop: Callable[[], bool]) -> bool:
        tlog, part = self.path(name, TLOG), self.path(name, _PART)
        rows = CsvRows(
            clock_offset_us((at_us, frame) for at_us, frame, _ in entries_in(tlog)) if tlog.exists() else None
        )
        with part.open("w", encoding="ascii") as file:
            file.write(HEADER)
            for number, (at_us, frame, _end) in enumerate(entries_in(tlog) if tlog.exists() else ()):
                row = rows.take(at_us, frame)
                if row:
                    file.write(row)
                if number % ENTRIES_A_TURN == ENTRIES_A_TURN - 1:
                    if stop():
                        return False
                    time.sleep(TURN_S)
        part.replace(self.path(name, CSV))
        return True

    def piece(self, name: str, from_us: int, to_us: int, at: int) -> tuple[bytes, int, bool]:
        """Returns whole entries of that time, where the next piece begins, and whether this was the last. `at`: 0, or
        where the last one said. Raises NoFlight, OSError."""
        tlog = self.path(name, TLOG)
        if not tlog.exists():
            raise NoFlight
        begin = at or self._begin_of(name, from_us)
        taken: list[bytes] = []
        size, after = 0, begin
        for at_us, frame, end in entries_in(tlog, begin):
            if at_us > to_us:
                return b"".join(taken), after, True
            if size + 8 + len(frame) > MAX_PIECE_BYTES:
                return b"".join(taken), after, False
            if at_us >= from_us:
                taken += (at_us.to_bytes(8), frame)
                size += 8 + len(frame)
            after = end
        return b"".join(taken), after, True

    def _begin_of(self, name: str, from_us: int) -> int:
        best = 0
        for at_us, at in self._times(name).marks:
            if at_us >= from_us:
                break
            best = at
        return best

    def _times(self, name: str) -> _Times:
        times = _Times()
        index = self.path(name, INDEX)
        if not index.exists():
            return times
        with index.open("rb") as file:
            for line in file:
                entry = _object(line)
                kind, at_us, at = entry.get("kind"), entry.get("at_us"), entry.get("at")
                if not isinstance(at_us, int):
                    continue
                if kind == "flight":
                    times.began_us = at_us
                elif kind == "end":
                    times.ended_us = at_us
                elif kind == "at" and isinstance(at, int):
                    times.marks.append((at_us, at))
        return times


def index_line(kind: str, at_us: int, **about: object) -> bytes:
    """One line of the index."""
    return _encoder.encode({"kind": kind, "at_us": at_us, **about}) + b"\n"


def _object(line: bytes) -> dict[str, object]:
    try:
        value = _decoder.decode(line)
    except msgspec.DecodeError:
        return {}
    return value if isinstance(value, dict) else {}
