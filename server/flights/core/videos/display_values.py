"""What the flight display of a recorded flight shows at a moment: the telemetry and the index of the flight, read in
order of time beside the pictures. Pure; in memory is one moment, whatever the length of the flight."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from struct import Struct
from typing import Any, Final

from server.flights.core.index import at_of
from server.flights.core.report_words import name_of
from server.flights.core.tlog import Entry
from wire.autopilots import registry
from wire.dialect import mavlink
from wire.frames import message_id, payload, source
from wire.places import place_of

STALE_US: Final = 2_000_000
"""A value that was heard longer ago is not shown: it would be a guess."""
STALE_SLOW_US: Final = 10_000_000
"""The same of what comes once a second or every five seconds."""
_AUTOPILOT: Final = mavlink.MAV_COMP_ID_AUTOPILOT1
_HEARTBEAT: Final = Struct("<IBBBBB")
_ATTITUDE: Final = Struct("<Iffffff")
_POSITION: Final = Struct("<IiiiihhhH")
_STATUS: Final = Struct("<IIIHHhHHHHHHb")
_LAYOUTS: Final = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: _HEARTBEAT,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: _ATTITUDE,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: _POSITION,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: _STATUS,
}


@dataclass(frozen=True, slots=True)
class DisplayValues:
    """One moment; None and empty: not known. `at_us`: microseconds since 1970. `heading_deg`: 0 to 360, where the nose
    points. `link`: in words. `hold`: the words of a hold that is open."""

    at_us: int
    height_m: float | None = None
    speed_m_s: float | None = None
    heading_deg: float | None = None
    roll_deg: float | None = None
    pitch_deg: float | None = None
    battery_v: float | None = None
    battery_percent: int | None = None
    mode: str = ""
    holder: str = ""
    link: str = ""
    hold: str = ""


class DisplayTimeline:
    """Ask in order of time. `entries`: of the telemetry log; `index`: the lines of the flight's index, in order of
    time."""

    def __init__(self, entries: Iterable[Entry], index: Iterable[dict[str, Any]]) -> None:
        self._entries, self._index = iter(entries), iter(index)
        self._next_entry = next(self._entries, None)
        self._next_line = next(self._index, None)
        self._heard_us: dict[int, int] = {}
        self._read: dict[int, tuple[Any, ...]] = {}
        """The newest values of each kind of message."""
        self._holder = self._link = self._hold = ""
        self._is_lost = False
        self._link_us = 0

    def at(self, at_us: int) -> DisplayValues:
        """What was known then. Not before an earlier call's time."""
        while self._next_entry is not None and self._next_entry.at_us <= at_us:
            self._take(self._next_entry)
            self._next_entry = next(self._entries, None)
        while self._next_line is not None and at_of(self._next_line) <= at_us:
            self._note(self._next_line)
            self._next_line = next(self._index, None)
        position = self._fresh(mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, at_us, STALE_US)
        attitude = self._fresh(mavlink.MAVLINK_MSG_ID_ATTITUDE, at_us, STALE_US)
        status = self._fresh(mavlink.MAVLINK_MSG_ID_SYS_STATUS, at_us, STALE_SLOW_US)
        heart = self._fresh(mavlink.MAVLINK_MSG_ID_HEARTBEAT, at_us, STALE_SLOW_US)
        knows_link = self._is_lost or at_us - self._link_us <= STALE_SLOW_US
        return DisplayValues(
            at_us=at_us,
            height_m=None if position is None else position[4] / 1000,
            speed_m_s=None if position is None else math.hypot(position[5], position[6]) / 100,
            heading_deg=_heading(position, attitude),
            roll_deg=None if attitude is None else math.degrees(attitude[1]),
            pitch_deg=None if attitude is None else math.degrees(attitude[2]),
            battery_v=None if status is None or status[4] == 0xFFFF else status[4] / 1000,
            battery_percent=None if status is None or status[12] < 0 else status[12],
            mode="" if heart is None else registry.nearest(heart[2], heart[1]).mode_name(heart[0]),
            holder=self._holder,
            link=self._link if knows_link else "",
            hold=self._hold,
        )

    def _fresh(self, kind: int, at_us: int, within_us: int) -> tuple[Any, ...] | None:
        values = self._read.get(kind)
        return values if values is not None and at_us - self._heard_us[kind] <= within_us else None

    def _take(self, entry: Entry) -> None:
        frame = entry.frame
        kind = message_id(frame)
        layout = _LAYOUTS.get(kind)
        if layout is None or source(frame)[1] != _AUTOPILOT:
            return
        values = layout.unpack_from(payload(frame).ljust(layout.size, b"\0"))
        if kind == mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT and place_of(values[1], values[2]) is None:
            return
        self._read[kind], self._heard_us[kind] = values, entry.at_us

    def _note(self, line: dict[str, Any]) -> None:
        match line.get("kind"):
            case "armed" | "control":
                self._holder = name_of(line.get("holder"))
            case "hold":
                self._hold = _HOLD_WORDS.get(str(line.get("step")), self._hold)
            case "sticks" | "disarmed":
                self._hold = ""
            case "command" if line.get("state") == "running":
                self._hold = ""
            case "link":
                self._link, self._link_us, self._is_lost = _link_words(line), at_of(line), False
            case "link_lost":
                self._link, self._is_lost = "LINK LOST", True
            case "link_back":
                self._link, self._link_us, self._is_lost = "LINK", at_of(line), False


_HOLD_WORDS: Final = {
    "ordered": "HOLD",
    "sticks_centred": "HOLD",
    "mode_requested": "HOLD",
    "mode_acknowledged": "HOLD",
    "confirmed": "HOLD",
    "unconfirmed": "HOLD NOT CONFIRMED",
    "not_needed": "",
}
"""A hold is open until somebody flies: sticks or a command."""


def _heading(position: tuple[Any, ...] | None, attitude: tuple[Any, ...] | None) -> float | None:
    if position is not None and position[8] != 0xFFFF:
        return float(position[8]) / 100 % 360
    return None if attitude is None else math.degrees(attitude[3]) % 360


def _link_words(line: dict[str, Any]) -> str:
    rtt_ms, loss = line.get("rtt_ms"), line.get("loss")
    words = "LINK" if not isinstance(rtt_ms, int | float) else f"LINK {rtt_ms:.0f} ms"
    return words if not isinstance(loss, int | float) else f"{words}, {100 * loss:.0f} %"


def in_order(lines: Iterable[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """The lines of an index by their time: a command's line is written with its answer."""
    return iter(sorted(lines, key=at_of))
