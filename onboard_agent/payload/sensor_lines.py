"""Lines of JSON from a sensor on board, checked, time-stamped, as MAVLink. Pure: bytes and `now` in, frames out.

    {"co2_ppm": 415.2, "temp_c": 21.5, "t": 123456}
    {"event": "sample taken"}*5B

Each number becomes a NAMED_VALUE_FLOAT of that name, an `event` a STATUSTEXT. `t` is the sensor's own clock in
milliseconds; without it the time of arrival counts. Behind a `*` may stand the XOR of the bytes before it, as in NMEA,
and then it must be right. A line that breaks a rule is dropped as a whole and counted.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from functools import reduce
from operator import xor
from typing import Any, Final

import msgspec

from onboard_agent.autopilot.own_frames import AGENT_COMPONENT, FrameMaker, Sender
from wire.dialect import mavlink

MAX_LINE_BYTES: Final = 512
MAX_VALUES: Final = 16
"""Numbers in a line."""
MAX_NAMES: Final = 32
"""Names of a drone: the console keeps ten minutes of each."""
MIN_INTERVAL_S: Final = 0.1
"""Of values with the same name: a faster one is dropped, so that a sensor cannot fill the link."""
EVENT_INTERVAL_S: Final = 1.0
MAX_EVENT_CHARACTERS: Final = 50
"""Of a STATUSTEXT."""
MAX_FLOAT: Final = 3.4e38
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,9}")
_SUM: Final = re.compile(rb"(.*)\*([0-9A-Fa-f]{2})", re.DOTALL)


class BadLine(ValueError):
    """A line that is dropped. The message is the reason that it is counted by."""


class SensorLines:
    """Call `feed` with bytes as they come; `restart` when a new stream begins."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        """Dropped lines and values, by reason."""
        self._buffer = b""
        self._skips = False
        self._maker = FrameMaker()
        self._sent_at: dict[str, float] = {}
        self._event_at = float("-inf")
        self._clock = SensorClock()

    def restart(self) -> None:
        """Forgets half a line, and the sensor's clock."""
        self._buffer, self._skips = b"", True
        self._clock = SensorClock()

    def feed(self, data: bytes, now: float, system_id: int) -> list[bytes]:
        """Returns the frames to send, of the companion computer of this vehicle."""
        *lines, self._buffer = (self._buffer + data).split(b"\n")
        frames: list[bytes] = []
        for line in lines:
            if self._skips:  # the rest of a line whose beginning is not known, or was too long
                self._skips = False
                continue
            if line.strip():
                frames += self._line(line.strip(), now, system_id)
        if len(self._buffer) > MAX_LINE_BYTES:
            self._buffer, self._skips = b"", True
            self.counts["line too long"] += 1
        return frames

    def _line(self, line: bytes, now: float, system_id: int) -> list[bytes]:
        try:
            values, event, clock_ms = parse_line(line)
        except BadLine as error:
            self.counts[str(error)] += 1
            return []
        stamp_ms = round(self._clock.own_time(clock_ms, now) * 1000) & 0xFFFF_FFFF
        made: list[Any] = []
        for name, value in values.items():
            if self._may_send(name, now):
                made.append(mavlink.MAVLink_named_value_float_message(stamp_ms, name.encode(), value))
        if event and now - self._event_at >= EVENT_INTERVAL_S:
            self._event_at = now
            made.append(mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_INFO, event.encode()))
        elif event:
            self.counts["too many events"] += 1
        sender = Sender(system_id, AGENT_COMPONENT)
        return [self._maker.make(one, sender) for one in made]

    def _may_send(self, name: str, now: float) -> bool:
        last = self._sent_at.get(name)
        if last is None and len(self._sent_at) >= MAX_NAMES:
            self.counts["too many names"] += 1
            return False
        if last is not None and now - last < MIN_INTERVAL_S:
            self.counts["too fast"] += 1
            return False
        self._sent_at[name] = now
        return True


class SensorClock:
    """Puts the sensor's times on our clock. A line is late by what the serial line and the scheduler add, never early:
    so the smallest difference seen is nearest to the truth."""

    JUMP_S: Final = 2.0
    """A clock that is off by more was set, or its sensor has restarted."""

    def __init__(self) -> None:
        self._difference_s: float | None = None

    def own_time(self, clock_ms: float | None, now: float) -> float:
        """Returns when the line's values were measured, at the latest `now`."""
        if clock_ms is None:
            return now
        difference = now - clock_ms / 1000
        known = self._difference_s
        self._difference_s = (
            difference if known is None or abs(difference - known) > self.JUMP_S else min(known, difference)
        )
        return min(now, clock_ms / 1000 + self._difference_s)


def parse_line(line: bytes) -> tuple[Mapping[str, float], str, float | None]:
    """Returns (values by name, event or "", the sensor's clock in milliseconds or None). Raises BadLine."""
    if len(line) > MAX_LINE_BYTES:
        raise BadLine("line too long")
    summed = _SUM.fullmatch(line)
    if summed is not None:
        line, expected = summed[1], int(summed[2], 16)
        if reduce(xor, line, 0) != expected:
            raise BadLine("wrong checksum")
    try:
        fields = msgspec.json.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        raise BadLine("not JSON") from None
    if not isinstance(fields, dict) or not fields:
        raise BadLine("not an object")
    event, clock = fields.pop("event", ""), fields.pop("t", None)
    if not isinstance(event, str) or len(event) > MAX_EVENT_CHARACTERS or not (event.isascii() and event.isprintable()):
        raise BadLine("bad event")
    if clock is not None and (not _is_number(clock) or clock < 0):
        raise BadLine("bad time")
    if len(fields) > MAX_VALUES:
        raise BadLine("too many values")
    if not all(_NAME.fullmatch(name) for name in fields):
        raise BadLine("bad name")
    if not all(map(_is_number, fields.values())):
        raise BadLine("not a number")
    if not event and len(fields) == 0:
        raise BadLine("nothing in it")
    return fields, event, clock


def _is_number(value: object) -> bool:
    """A number that a float carries; not NaN, and not True."""
    return type(value) in (int, float) and abs(value) <= MAX_FLOAT  # type: ignore[arg-type]
