"""Lists the flight logs of the autopilot, then requests missing entries. No I/O; takes `now`.

Rules, each tested:
- The list is complete when its entries match the reported number of logs; an entry that reports zero logs is a list.
- After the autopilot falls silent, missing entries are requested as one range after another.
- A list that stays incomplete is reported as far as it goes, and marked incomplete.
"""

from dataclasses import dataclass
from typing import Any, Final

from onboard_agent.transactions.log_frames import ALL, LogFrames, LogPace
from wire.transactions import LogEntry

SILENT: Final = "the autopilot does not answer (it gives no logs while somebody else reads them)"


@dataclass(frozen=True, slots=True)
class LogsListed:
    """`missing`: number of further logs, according to the autopilot."""

    logs: tuple[LogEntry, ...]
    missing: int = 0


@dataclass(frozen=True, slots=True)
class LogsNotListed:
    """`why`: without a full stop."""

    why: str


class LogListing:
    """Call `due` at each tick and after each `receive`, until `end` is set."""

    def __init__(self, talk: LogFrames, pace: LogPace, *, only: int | None = None) -> None:
        """`only`: the number of the one log to look up."""
        self._talk = talk
        self._pace = pace
        self._only = only
        self._logs: dict[int, LogEntry] = {}
        self._count: int | None = None
        self._last = 0
        self._range = ALL if only is None else (only, only)
        self._asked = 0
        """Consecutive requests without an answer."""
        self._again_at = float("-inf")
        self.end: LogsListed | LogsNotListed | None = None

    @property
    def progress(self) -> tuple[int, int]:
        """Logs listed, and logs in total (0: not known yet)."""
        return len(self._logs), 1 if self._only is not None else self._count or 0

    def receive(self, entry: Any, now: float) -> bool:
        """Takes a LOG_ENTRY of the autopilot. Returns whether it was new."""
        if self.end is not None or not self._asked:
            return False
        if self._only is not None and entry.id != self._only and entry.num_logs:
            return False
        self._count, self._last = entry.num_logs, entry.last_log_num
        reports = bool(entry.num_logs) and entry.id not in self._logs
        if reports:
            self._logs[entry.id] = LogEntry(entry.id, entry.size, entry.time_utc or None)
            self._asked = 1
            self._again_at = now + self._pace.quiet_s
        if len(self._logs) >= (self._count if self._only is None else min(1, self._count)):
            self._finish()
        return reports

    def due(self, now: float) -> list[bytes]:
        """Frames to send now."""
        if self.end is not None or now < self._again_at:
            return []
        if self._asked >= self._pace.tries:
            self._give_up()
            return []
        if self._logs:
            self._range = self._first_gap()
        self._asked += 1
        self._again_at = now + (self._pace.quiet_s if self._logs else self._pace.first_s)
        return [self._talk.ask_list(*self._range)]

    def _first_gap(self) -> tuple[int, int]:
        """Uses the last log number, because ArduPilot numbers logs from 1 and PX4 from 0."""
        assert self._count is not None
        first = max(self._last - self._count + 1, 0)
        missing = [number for number in range(first, self._last + 1) if number not in self._logs]
        if not missing:
            return ALL  # the numbering is not consecutive
        end = missing[0]
        while end + 1 in missing:
            end += 1
        return missing[0], end

    def _give_up(self) -> None:
        if self._logs or self._count == 0:
            self._finish()
        else:
            self.end = LogsNotListed(SILENT)

    def _finish(self) -> None:
        logs = tuple(self._logs[number] for number in sorted(self._logs, reverse=True))
        missing = max((self._count or 0) - len(logs), 0) if self._only is None else 0
        self.end = LogsListed(logs, missing)
