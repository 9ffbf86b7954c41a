"""PX4's EVENT messages about its failsafes: numbers and packed arguments, as measured on 1.16."""

from __future__ import annotations

import struct

from simulator.dialect import Event


def number(name: str) -> int:
    """The hash of a name, as a number of the autopilot's own events."""
    value = 0x811C9DC5
    for byte in name.encode():
        value = (value ^ byte) * 0x01000193 & 0xFFFFFFFF
    return value & 0xFFFFFF | 1 << 24


def check_report(failing: str | None) -> list[Event]:
    """The arming checks: a summary, the check that fails in every mode, and the end."""
    summary = Event(number("commander_arming_check_summary"), struct.pack("<BQQII", 0, 0, 0, 0, 0))
    end = Event(number("commander_health_summary"), struct.pack("<BQQQ", 0, 0, 0, 0))
    check = [] if failing is None else [Event(number(failing), struct.pack("<IB", 0xFFFFFFFF, 0))]
    return [summary, *check, end]


def entered_hold(mode: int, action: int, delay_s: int, cause: int) -> Event:
    """Holds for `delay_s`, and acts then."""
    packed = struct.pack("<IBHB", mode, action, delay_s, cause)
    return Event(number("commander_failsafe_enter_hold"), packed)


def entered(mode: int, action: int, cause: int) -> Event:
    """Acts at once."""
    return Event(number("commander_failsafe_enter"), struct.pack("<IBB", mode, action, cause))
