"""The log of a flight as CSV: one line each half second, with an index that rises by one and is never used again.

Who writes it: `firmware.flight_csv` for the flight controller alone, `vehicle_csv` for the vehicles of `tower-sim`.
"""

from __future__ import annotations

import contextlib
import csv
import io
import itertools
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final, TextIO

PERIOD_S = 0.5
COLUMNS: Final = (
    "index", "time_s", "state",
    "north_m", "east_m", "alt_m", "roll_deg", "pitch_deg", "yaw_deg",
    "estimate_north_m", "estimate_east_m", "estimate_alt_m", "estimate_roll_deg", "estimate_pitch_deg",
    "estimate_yaw_deg",
    "motor_1", "motor_2", "motor_3", "motor_4", "volts", "amperes",
)  # fmt: skip
HEADER: Final = ",".join(COLUMNS) + "\n"
MAX_LINES = 1_000_000


class NotALog(ValueError):
    """These bytes are not the log of a flight."""


def open_new(path: Path) -> TextIO:
    """Opens a file for writing. One that is there stays: the next free number is added, from 2. Raises OSError."""
    for number in itertools.count(1):
        one = path if number == 1 else path.with_stem(f"{path.stem}-{number}")
        with contextlib.suppress(FileExistsError):
            return one.open("x")
    raise AssertionError


class CsvLines:
    """Says when a line is due, and makes it. After a restart of the vehicle the time goes on rising."""

    def __init__(self, period_s: float = PERIOD_S) -> None:
        """`period_s` 0: a line for every step."""
        self._period_s = period_s
        self._due_s: float | None = None
        self._last_s = 0.0
        self._before_s = 0.0
        """Of the lives before the last restart."""
        self._index = 0

    def due(self, now_s: float) -> bool:
        if now_s < self._last_s:
            self._before_s += self._last_s
            self._due_s = None
        self._last_s = now_s
        if self._due_s is None:
            self._due_s = now_s
        if now_s < self._due_s - 1e-9:
            return False
        self._due_s = max(self._due_s + self._period_s, now_s)
        return True

    def line(self, now_s: float, state: str, numbers: Iterable[float]) -> str:
        """`numbers`: the columns after the state."""
        self._index += 1
        cells = ",".join(f"{number:.4f}" for number in numbers)
        return f"{self._index},{self._before_s + now_s:.3f},{state},{cells}\n"


def read(text: str) -> Mapping[str, Sequence[float]]:
    """Returns the columns of numbers of a log. Raises NotALog."""
    rows = list(csv.DictReader(io.StringIO(text)))
    if not rows or tuple(rows[0]) != COLUMNS or len(rows) > MAX_LINES:
        raise NotALog("this is not a flight log")
    numbers = [name for name in COLUMNS if name != "state"]
    try:
        columns = {name: [float(row[name]) for row in rows] for name in numbers}
    except (TypeError, ValueError) as error:
        raise NotALog("a line of this log is damaged") from error
    if columns["index"] != [float(number) for number in range(1, len(rows) + 1)]:
        raise NotALog("lines of this log are missing")
    return columns
