"""The logs on board, one for each arming. Excess logs are deleted, oldest first; a full one is closed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum

from simulator import dataflash
from simulator.flight import Flight
from simulator.flight_constants import TICK_S
from simulator.reports_health import BOOT_UNIX_US

LOGS_MAX = 5
LOG_BYTES_MAX = 256 * 1024
"""About a quarter of an hour."""
FAST_LOG_BYTES_MAX = 8 * 1024 * 1024
"""The same, at full rate."""
ATTITUDE_S, POSITION_S, SLOW_S = 0.2, 0.5, 1.0
ATTITUDE_FAST = 1
"""LOG_BITMASK. Here the position too."""


@dataclass(slots=True)
class Log:
    begun_unix_s: int
    data: bytearray = field(default_factory=bytearray)


class Logbook:
    def __init__(self, banner: Sequence[str] = ()) -> None:
        self._banner = banner
        self.logs: list[Log] = []
        """The oldest first; numbered from 1 on the wire."""
        self._writing: Log | None = None
        self._mode: IntEnum | None = None
        self._due_s: dict[str, float] = {}
        self._next_s = 0.0
        self._fast = False
        """Attitude and position in every tick: chosen for a whole log."""

    def clear(self) -> None:
        self.logs.clear()
        self._writing = None

    def update(self, flight: Flight, notices: Sequence[str]) -> None:
        """Logs one tick; `notices` are the texts of this tick."""
        if not flight.armed:
            self._writing = None
            return
        if self._writing is None:
            self._begin(flight)
        if notices:
            self._write(dataflash.texts(flight, notices))
        if flight.mode is not self._mode:
            self._mode = flight.mode
            self._write(dataflash.mode(flight))
        if flight.now_s + 1e-9 < self._next_s:
            return
        if self._is_due("attitude", TICK_S if self._fast else ATTITUDE_S, flight.now_s):
            self._write(dataflash.attitude(flight))
        if self._is_due("position", TICK_S if self._fast else POSITION_S, flight.now_s):
            self._write(dataflash.position(flight))
        if self._is_due("slow", SLOW_S, flight.now_s):
            self._write(dataflash.receiver(flight, BOOT_UNIX_US + dataflash.us(flight)) + dataflash.battery(flight))
        self._next_s = min(self._due_s.values())

    def _begin(self, flight: Flight) -> None:
        self._writing = Log((BOOT_UNIX_US + dataflash.us(flight)) // 1_000_000)
        self.logs = [*self.logs, self._writing][-LOGS_MAX:]
        self._mode, self._due_s, self._next_s = flight.mode, {}, 0.0
        self._fast = bool(flight.parameters.whole("LOG_BITMASK") & ATTITUDE_FAST)
        self._write(dataflash.beginning(flight, self._banner))

    def _is_due(self, what: str, period_s: float, now_s: float) -> bool:
        if now_s + 1e-9 < self._due_s.get(what, now_s):
            return False
        self._due_s[what] = now_s + period_s
        return True

    def _write(self, records: bytes) -> None:
        log = self._writing
        room = FAST_LOG_BYTES_MAX if self._fast else LOG_BYTES_MAX
        if log is not None and len(log.data) + len(records) <= room:
            log.data += records
