"""The logs on board, one for each arming. Excess logs are deleted, oldest first; a full one is closed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

from simulator import dataflash
from simulator.flight import Flight
from simulator.reports_health import BOOT_UNIX_US

LOGS_MAX = 5
LOG_BYTES_MAX = 256 * 1024
"""About a quarter of an hour."""
ATTITUDE_S, POSITION_S, SLOW_S = 0.2, 0.5, 1.0


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

    def clear(self) -> None:
        self.logs.clear()
        self._writing = None

    def update(self, flight: Flight, notices: Iterable[str]) -> None:
        """Logs one tick; `notices` are the texts of this tick."""
        if not flight.armed:
            self._writing = None
            return
        if self._writing is None:
            self._begin(flight)
        self._write(dataflash.texts(flight, notices))
        if flight.mode is not self._mode:
            self._mode = flight.mode
            self._write(dataflash.mode(flight))
        if self._is_due("attitude", ATTITUDE_S, flight.now_s):
            self._write(dataflash.attitude(flight))
        if self._is_due("position", POSITION_S, flight.now_s):
            self._write(dataflash.position(flight))
        if self._is_due("slow", SLOW_S, flight.now_s):
            self._write(dataflash.receiver(flight, BOOT_UNIX_US + dataflash.us(flight)) + dataflash.battery(flight))

    def _begin(self, flight: Flight) -> None:
        self._writing = Log((BOOT_UNIX_US + dataflash.us(flight)) // 1_000_000)
        self.logs = [*self.logs, self._writing][-LOGS_MAX:]
        self._mode, self._due_s = flight.mode, {}
        self._write(dataflash.beginning(flight, self._banner))

    def _is_due(self, what: str, period_s: float, now_s: float) -> bool:
        if now_s + 1e-9 < self._due_s.get(what, now_s):
            return False
        self._due_s[what] = now_s + period_s
        return True

    def _write(self, records: bytes) -> None:
        log = self._writing
        if log is not None and len(log.data) + len(records) <= LOG_BYTES_MAX:
            log.data += records
