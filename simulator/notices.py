"""Texts for the ground station, sent as STATUSTEXT."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from simulator.dialect import Event


class Severity(IntEnum):
    """MAV_SEVERITY."""

    EMERGENCY = 0
    ALERT = 1
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6


@dataclass(frozen=True, slots=True)
class Notice:
    severity: Severity
    text: str
    event: Event | None = None
    """Sent with it."""
