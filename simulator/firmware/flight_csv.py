"""The log of a flight as CSV: one line each half second, with an index that rises by one and is never used again."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from simulator.firmware.controller import Fleet
from simulator.physics.rotation import to_euler

PERIOD_S = 0.5
COLUMNS: Final = (
    "index", "time_s", "state",
    "north_m", "east_m", "alt_m", "roll_deg", "pitch_deg", "yaw_deg",
    "estimate_north_m", "estimate_east_m", "estimate_alt_m", "estimate_roll_deg", "estimate_pitch_deg",
    "estimate_yaw_deg",
    "motor_1", "motor_2", "motor_3", "motor_4", "volts", "amperes",
)  # fmt: skip
MAX_LINES = 1_000_000


class NotALog(ValueError):
    """This text is not a log that FlightCsv wrote."""


class FlightCsv:
    """`note` is called after each step and returns the line that is due, or nothing. `period_s` 0: every step."""

    def __init__(self, fleet: Fleet, vehicle: int = 0, period_s: float = PERIOD_S) -> None:
        self._fleet, self._vehicle, self._period_s = fleet, vehicle, period_s
        self._due_s = fleet.now_s
        self._index = 0

    def header(self) -> str:
        return ",".join(COLUMNS) + "\n"

    def note(self) -> str:
        fleet, one = self._fleet, self._vehicle
        if fleet.now_s < self._due_s - 1e-9:
            return ""
        self._due_s = max(self._due_s + self._period_s, fleet.now_s)
        body, state, battery = fleet.body, fleet.filter.state, fleet.board.batteries
        values: list[float] = []
        for position, attitude in ((body.position_m, body.attitude), (state.position_m, state.attitude)):
            north_m, east_m, down_m = position[:, one].tolist()
            values += [north_m, east_m, -down_m, *np.degrees(to_euler(attitude)[:, one]).tolist()]
        values += [*fleet.commands[:, one].tolist(), float(battery.voltage_v[one]), float(battery.current_a[one])]
        self._index += 1
        numbers = ",".join(f"{value:.4f}" for value in values)
        return f"{self._index},{fleet.now_s:.3f},{fleet.commanders[one].state.value},{numbers}\n"


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
