"""Units and clocks that all reports share."""

from __future__ import annotations

from simulator.flight import Flight


def ms(flight: Flight) -> int:
    """Milliseconds since boot."""
    return round(flight.now_s * 1000) & 0xFFFFFFFF


def us(flight: Flight) -> int:
    return round(flight.now_s * 1_000_000)


def milli(value: float) -> int:
    return round(value * 1000)


def centi(value: float) -> int:
    return round(value * 100)


def int16(value: float) -> int:
    return min(max(round(value), -32768), 32767)
