"""The CSV log of one vehicle of a fleet."""

from __future__ import annotations

import numpy as np

from simulator.firmware.controller import Fleet
from simulator.flight_log import PERIOD_S, CsvLines
from simulator.physics.rotation import to_euler


class FlightCsv:
    """`note` is called after each step and returns the line that is due, or nothing."""

    def __init__(self, vehicle: int = 0, period_s: float = PERIOD_S) -> None:
        """`period_s` 0: every step."""
        self._vehicle = vehicle
        self._lines = CsvLines(period_s)

    def note(self, fleet: Fleet) -> str:
        one = self._vehicle
        if not self._lines.due(fleet.now_s):
            return ""
        body, state, battery = fleet.body, fleet.filter.state, fleet.board.batteries
        values: list[float] = []
        for position, attitude in ((body.position_m, body.attitude), (state.position_m, state.attitude)):
            north_m, east_m, down_m = position[:, one].tolist()
            values += [north_m, east_m, -down_m, *np.degrees(to_euler(attitude)[:, one]).tolist()]
        values += [*fleet.commands[:, one].tolist(), float(battery.voltage_v[one]), float(battery.current_a[one])]
        return self._lines.line(fleet.now_s, fleet.commanders[one].state.value, values)
