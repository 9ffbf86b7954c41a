"""Facts measured on ArduCopter: a table of checks named after the measured lines, and their helpers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from simulator.modes import Mode

ACCEPTED, FAILED = 0, 4

CENTRED = (1500, 1500, 1500, 1500)
Make = Callable[..., Any]
Fact = Callable[[Make], None]


def fact_table() -> tuple[list[Any], Callable[[str], Callable[[Fact], None]]]:
    """Returns the rows of one file, and the decorator that adds a check to them under its measured line."""
    rows: list[Any] = []

    def fact(line: str) -> Callable[[Fact], None]:
        return lambda check: rows.append(pytest.param(check, id=line))

    return rows, fact


def centre(station: Any) -> None:
    station.sticks = station.override(*CENTRED)


def in_mode(ground: Make, mode: Mode, alt_m: float = 20.0, **options: Any) -> Any:
    """Returns a vehicle in the air, with centred sticks streaming, in `mode` and settled."""
    station = ground(**options).take_off(alt_m)
    centre(station)
    assert station.set_mode(mode) == ACCEPTED
    station.run(3)
    return station


def stop_sticks(station: Any) -> None:
    station.sticks = None


def mode_after(station: Any, seconds: float) -> Mode:
    station.run(seconds)
    mode: Mode = station.flight.mode
    return mode


def sink_rate(station: Any) -> float:
    return float(station.body.vd_mps)
