"""The index of a flight: one JSON object a line, beside its `.tlog`. Pure.

The first line is the head: which drone, and when it was armed. Every other line has `at_us` (microseconds since 1970)
and `kind`; docs/flights.md lists the kinds. A reader skips kinds that it does not know.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, Final

import msgspec

from server.flights.core.recorder import FlightHead

VERSION: Final = 1
MAX_US: Final = 2**63 - 1
MAX_INDEX_BYTES: Final = 8 * 1024 * 1024
"""Of one flight. Some ten thousand entries; nobody reads more."""
_decoder: Final = msgspec.json.Decoder()
_encoder: Final = msgspec.json.Encoder()


class NoIndex(ValueError):
    """The first line is not the head of a flight."""


@dataclass(frozen=True)
class Pilot:
    user_id: int | None
    name: str


@dataclass
class IndexSummary:
    """What the catalogue takes from the index. `ended_us`: None where the flight was not seen to its end."""

    drone_id: int
    drone_name: str
    began_us: int
    ended_us: int | None = None
    is_over: bool = False
    words: str = ""
    pilots: list[Pilot] = field(default_factory=list)


def head_line(head: FlightHead) -> bytes:
    about: dict[str, Any] = {"kind": "flight", "version": VERSION, "drone_id": head.drone_id, "drone": head.drone_name}
    about |= {"began_at": head.began_at.astimezone(UTC).isoformat(), "before_s": head.before_s}
    return _encoder.encode(about)


def whole_lines(content: bytes) -> list[bytes]:
    """The lines up to the last complete one that is JSON."""
    lines = content.split(b"\n")[:-1]
    while lines and not _is_object(lines[-1]):
        lines.pop()
    return lines


def read_index(lines: Iterable[bytes]) -> IndexSummary:
    """Raises NoIndex."""
    summary: IndexSummary | None = None
    for line in lines:
        entry = entry_of(line)
        if summary is None:
            summary = _head(entry)
            continue
        kind, at_us = entry.get("kind"), entry.get("at_us")
        if kind == "disarmed":
            summary.ended_us = at_us if isinstance(at_us, int) else None
        elif kind == "end":
            summary.is_over, summary.words = True, str(entry.get("words", ""))
            summary.ended_us = summary.ended_us or (at_us if isinstance(at_us, int) else None)
        for name in _PILOT_IN.get(str(kind), ()):
            _add_pilot(summary.pilots, entry.get(name))
    if summary is None:
        raise NoIndex("the index of the flight is empty")
    return summary


def index_end_us(lines: Iterable[bytes]) -> int:
    """When the recording was over: nothing later belongs to the flight. What a crash cut off has no such time."""
    for line in lines:
        entry = entry_of(line)
        at_us = entry.get("at_us")
        if entry.get("kind") == "end" and isinstance(at_us, int):
            return at_us
    return MAX_US


_PILOT_IN: Final = {"armed": ("holder",), "control": ("holder",), "sticks": ("by",), "turn": ("user",)}
"""Who flew: whoever had the controls, or whose sticks passed."""
MAX_PILOTS: Final = 50


def _add_pilot(pilots: list[Pilot], who: object) -> None:
    if not isinstance(who, dict) or not isinstance(who.get("name"), str) or len(pilots) >= MAX_PILOTS:
        return
    user_id = who.get("id")
    pilot = Pilot(user_id if isinstance(user_id, int) else None, who["name"])
    if pilot not in pilots:
        pilots.append(pilot)


def _head(entry: dict[str, Any]) -> IndexSummary:
    try:
        if entry["kind"] != "flight":
            raise NoIndex("the index does not begin with the flight")
        began_at = datetime.fromisoformat(entry["began_at"])
        return IndexSummary(int(entry["drone_id"]), str(entry["drone"]), round(began_at.timestamp() * 1e6))
    except (KeyError, TypeError, ValueError) as error:
        raise NoIndex(f"the head of the index cannot be read: {error}") from None


def at_of(entry: dict[str, Any]) -> int:
    """Returns when it happened, in microseconds since 1970; 0: it does not say."""
    at_us = entry.get("at_us")
    return at_us if isinstance(at_us, int) else 0


def entry_of(line: bytes) -> dict[str, Any]:
    """Returns one line of the index; empty if it is no JSON object."""
    try:
        value = _decoder.decode(line)
    except msgspec.DecodeError:
        return {}
    return value if isinstance(value, dict) else {}


def _is_object(line: bytes) -> bool:
    return bool(entry_of(line))
