"""Errors of ours that the hub survived: each place in the log once a minute, and all of them counted."""

import time
from collections import Counter, deque
from collections.abc import Callable
from typing import Final

import structlog

from server.link.core.traffic import Traffic
from wire.ids import DroneId

LOG_EVERY_S: Final = 60.0
REMEMBERED_S: Final = 600.0
MAX_REMEMBERED: Final = 1000
_log = structlog.get_logger(__name__)


class FaultLog:
    """For `LiveState.on_fault`."""

    def __init__(self, traffic: Traffic, monotonic: Callable[[], float] = time.monotonic) -> None:
        self._traffic = traffic
        self._monotonic = monotonic
        self._logged_at: dict[str, float] = {}
        self._recent: deque[tuple[float, str]] = deque(maxlen=MAX_REMEMBERED)

    def note(self, part: str, drone_id: DroneId | None, error: Exception) -> None:
        """`drone_id` None: it concerns no drone alone."""
        self._traffic.faults[part] += 1
        now = self._monotonic()
        self._recent.append((now, part))
        if now - self._logged_at.get(part, float("-inf")) >= LOG_EVERY_S:
            self._logged_at[part] = now
            _log.error("part_failed", part=part, drone_id=drone_id, exc_info=error)

    def worst(self) -> tuple[str, int] | None:
        """The part with the most errors in the last REMEMBERED_S, and how many; None: there was none."""
        since = self._monotonic() - REMEMBERED_S
        counted = Counter(part for at, part in self._recent if at >= since)
        return counted.most_common(1)[0] if counted else None
