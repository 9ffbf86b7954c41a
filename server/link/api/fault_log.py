"""Errors of ours that the hub survived: each place in the log once a minute, and all of them counted."""

import time
from typing import Final

import structlog

from server.link.core.traffic import Traffic
from wire.ids import DroneId

LOG_EVERY_S: Final = 60.0
_log = structlog.get_logger(__name__)


class FaultLog:
    """For `LiveState.on_fault`."""

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self._logged_at: dict[str, float] = {}

    def note(self, part: str, drone_id: DroneId | None, error: Exception) -> None:
        """`drone_id` None: it concerns no drone alone."""
        self._traffic.faults[part] += 1
        now = time.monotonic()
        if now - self._logged_at.get(part, float("-inf")) >= LOG_EVERY_S:
            self._logged_at[part] = now
            _log.error("part_failed", part=part, drone_id=drone_id, exc_info=error)
