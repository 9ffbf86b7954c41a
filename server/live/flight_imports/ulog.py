"""Reads PX4's log (`.ulg`). Pure.

A header, definitions (formats, parameters, infos), then subscriptions, data and logged texts. Each message has its size
and its kind before it. Source: PX4 User Guide, "ULog File Format".
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from mmap import mmap
from struct import Struct
from struct import error as StructError
from typing import Any, Final, NamedTuple, cast

from server.live.flight_imports.refusals import BadFlightFile

MAGIC: Final = b"ULog\x01\x12\x35"
_HEADER_BYTES: Final = 16
_HEAD: Final = Struct("<HB")
_APPENDED: Final = 0x01
"""The only incompatible flag that is defined: data are appended, in the same kinds of messages."""
_BASIC: Final = {
    "int8_t": "b",
    "uint8_t": "B",
    "int16_t": "h",
    "uint16_t": "H",
    "int32_t": "i",
    "uint32_t": "I",
    "int64_t": "q",
    "uint64_t": "Q",
    "float": "f",
    "double": "d",
    "bool": "?",
    "char": "c",
}
_FIELD: Final = re.compile(r"([a-zA-Z_][\w/]*)(?:\[(\d{1,5})\])? +(\w+)")
MAX_NESTING: Final = 4
MAX_MESSAGE_BYTES: Final = 0xFFFF
LOGGED: Final = "logged text"
"""The name of a record with `level` (0 to 7) and `message`."""
Buffer = bytes | mmap


class Record(NamedTuple):
    """One message of a topic. `instance`: of several of the same topic. Arrays are tuples."""

    name: str
    instance: int
    at_us: int
    fields: dict[str, Any]


class _Layout(NamedTuple):
    body: Struct
    fields: tuple[tuple[str, int, int], ...]
    """Name, place of the first value, and how many: 0 for a single value."""


class UlogReader:
    """Reads these topics and steps over the rest. `skipped`: bytes at the end that are no whole message."""

    def __init__(self, log: Buffer, names: Collection[str]) -> None:
        self._log = log
        self._names = names
        self._formats: dict[str, list[tuple[str, int, str]]] = {}
        self._topics: dict[int, tuple[str, int, _Layout]] = {}
        self.skipped = 0

    def __iter__(self) -> Iterator[Record]:
        """In the order of the file, up to the last whole message. Raises BadFlightFile."""
        log, end = self._log, len(self._log)
        if end < _HEADER_BYTES or log[: len(MAGIC)] != MAGIC:
            raise BadFlightFile("this is no ULog of PX4: it does not begin as one")
        at = _HEADER_BYTES
        while at + _HEAD.size <= end:
            size, kind = _HEAD.unpack_from(log, at)
            begin, after = at + _HEAD.size, at + _HEAD.size + size
            if after > end:
                break
            try:
                record = self._take(chr(kind), log[begin:after])
            except (StructError, UnicodeDecodeError, IndexError):
                record = None  # a damaged message: the next one begins where this one's size says
            if record is not None:
                yield record
            at = after
        self.skipped = end - at

    def _take(self, kind: str, body: bytes) -> Record | None:
        if kind == "D":
            topic = self._topics.get(int.from_bytes(body[:2], "little"))
            return None if topic is None else _record(*topic, body[2:])
        if kind in "LC":
            begin = 1 if kind == "L" else 3
            level, at_us = body[0] - ord("0"), int.from_bytes(body[begin : begin + 8], "little")
            text = body[begin + 8 :].decode("utf-8", "replace")
            return Record(LOGGED, 0, at_us, {"level": min(max(level, 0), 7), "message": text})
        if kind == "A":
            self._subscribe(body[0], int.from_bytes(body[1:3], "little"), body[3:].decode("ascii"))
        elif kind == "R":
            self._topics.pop(int.from_bytes(body[:2], "little"), None)
        elif kind == "F":
            name, _, fields = body.decode("ascii").partition(":")
            found = [_FIELD.fullmatch(field) for field in fields.split(";") if field]
            if all(found):
                self._formats[name] = [(one[1], int(one[2] or 0), one[3]) for one in found if one]
        elif kind == "B" and (body[8] & ~_APPENDED or any(body[9:16])):
            raise BadFlightFile("this ULog is of a newer kind that the tower cannot read")
        return None

    def _subscribe(self, instance: int, number: int, name: str) -> None:
        if name not in self._names:
            return
        codes: list[str] = []
        places: list[tuple[str, int, int]] = []
        values = 0
        for kind, count, field in self._formats.get(name, ()):
            letter = _BASIC.get(kind)
            if letter is None or field.startswith("_padding"):
                codes.append(f"{max(count, 1) * self._size(kind, MAX_NESTING)}x")
                continue
            codes.append(f"{max(count, 1)}{letter}")
            places.append((field, values, count))
            values += max(count, 1)
        while codes and codes[-1].endswith("x"):
            codes.pop()  # the log leaves out padding at the end
        if "timestamp" in (place[0] for place in places):
            self._topics[number] = name, instance, _Layout(Struct("<" + "".join(codes)), tuple(places))

    def _size(self, kind: str, depth: int) -> int:
        """Bytes of a type. Raises BadFlightFile."""
        letter = _BASIC.get(kind)
        if letter is not None:
            return Struct("<" + letter).size
        if depth == 0 or kind not in self._formats:
            raise BadFlightFile(f"this ULog uses a type that it does not explain: {kind[:40]}")
        size = sum(max(count, 1) * self._size(inner, depth - 1) for inner, count, _ in self._formats[kind])
        if size > MAX_MESSAGE_BYTES:
            raise BadFlightFile(f"this ULog has a type that no message can hold: {kind[:40]}")
        return size


def _record(name: str, instance: int, layout: _Layout, body: bytes) -> Record | None:
    values = layout.body.unpack_from(body)
    fields = {field: values[place : place + count] if count else values[place] for field, place, count in layout.fields}
    return Record(name, instance, cast(int, fields["timestamp"]), fields)
