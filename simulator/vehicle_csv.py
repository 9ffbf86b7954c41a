"""The CSV logs of the vehicles of `tower-sim`: a file each, written while they fly."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

from simulator.airframe import MOTOR_MAX_N, euler_rad
from simulator.flight_log import HEADER, PERIOD_S, CsvLines, open_new
from simulator.vehicle import Vehicle


class VehicleCsv:
    """`note` is called after each step and returns the line that is due, or nothing."""

    def __init__(self, vehicle: Vehicle, period_s: float = PERIOD_S) -> None:
        """`period_s` 0: every step."""
        self._vehicle = vehicle
        self._lines = CsvLines(period_s)

    def note(self) -> str:
        flight = self._vehicle.flight
        if not self._lines.due(flight.now_s):
            return ""
        body, battery = flight.body, flight.battery
        north_m, east_m, alt_m, quaternion = body.true_pose
        values = [north_m, east_m, alt_m, *_degrees(euler_rad(*quaternion))]
        values += [body.north_m, body.east_m, body.alt_m, *_degrees(body.attitude())]
        values += [math.sqrt(max(thrust_n, 0.0) / MOTOR_MAX_N) for thrust_n in body.thrust_n]
        commander = flight.commander
        state = flight.mode.name if commander is None else commander.state.value
        return self._lines.line(flight.now_s, state, [*values, battery.voltage_v, battery.current_a])


class FlightLogs:
    """`vehicle-1.csv` and so on, in one folder. Logs of before stay (`open_new`)."""

    def __init__(self, folder: Path, vehicles: Sequence[Vehicle], period_s: float = PERIOD_S) -> None:
        """Raises OSError."""
        folder.mkdir(parents=True, exist_ok=True)
        self._open: list[tuple[VehicleCsv, TextIO]] = []
        for number, vehicle in enumerate(vehicles, start=1):
            file = open_new(folder / f"vehicle-{number}.csv")
            file.write(HEADER)
            self._open.append((VehicleCsv(vehicle, period_s), file))

    def step(self) -> None:
        for log, file in self._open:
            file.write(log.note())

    def close(self) -> None:
        for _, file in self._open:
            file.close()


def _degrees(angles_rad: tuple[float, float, float]) -> list[float]:
    return [math.degrees(angle) for angle in angles_rad]
