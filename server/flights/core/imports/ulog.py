"""Reads PX4's log (`.ulg`). Pure.

A header, definitions (formats, parameters, infos), then subscriptions, data and logged texts. Each message has its size
and its kind before it. Source: PX4 User Guide, "ULog File Format".

After a torn place the reader goes on at PX4's next synchronisation mark, or where four messages follow each other.
Data that PX4 appends after a crash begin at a place that the flags name: what stands before it may be half a message.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from mmap import mmap
from struct import Struct
from struct import error as StructError
from typing import Any, Final, NamedTuple, cast

from server.flights.core.imports.refusals import BadFlightFile

MAGIC: Final = b"ULog\x01\x12\x35"
_HEADER_BYTES: Final = 16
_HEAD: Final = Struct("<HB")
_APPENDED: Final = 0x01
"""The only incompatible flag that is defined: data are appended, in the same kinds of messages."""
_OFFSETS: Final = Struct("<3Q")
_OFFSETS_AT: Final = 16
_KINDS: Final = frozenset(b"BFIMPQADRSLCO")
_FLAGS: Final = ord("B")
"""Only at the beginning: elsewhere it is a torn place."""
_SYNC: Final = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
_IN_A_ROW: Final = 4
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
    """Reads these topics and steps over the rest. `skipped`: bytes that belong to no message. `began_us`: when the log
    began, in microseconds since boot."""

    def __init__(self, log: Buffer, names: Collection[str]) -> None:
        self._log = log
        self._names = names
        self._formats: dict[str, list[tuple[str, int, str]]] = {}
        """The first definition of a name counts, so that what was made of it holds."""
        self._layouts: dict[str, _Layout | None] = {}
        """None: a topic without a time."""
        self._sizes: dict[str, int] = {}
        self._topics: dict[int, tuple[str, int, _Layout]] = {}
        self._appended: list[int] = []
        self._mark = -1
        """The synchronisation mark that was found last; it is searched for once, however often the log is torn."""
        self.skipped = 0
        self.began_us = 0

    def __iter__(self) -> Iterator[Record]:
        """In the order of the file, up to the last whole message. Raises BadFlightFile."""
        log, end = self._log, len(self._log)
        if end < _HEADER_BYTES or log[: len(MAGIC)] != MAGIC:
            raise BadFlightFile("this is no ULog of PX4: it does not begin as one")
        self.began_us = int.from_bytes(log[8:_HEADER_BYTES], "little")
        at = _HEADER_BYTES
        while at + _HEAD.size <= end:
            size, kind = _HEAD.unpack_from(log, at)
            begin, after = at + _HEAD.size, at + _HEAD.size + size
            appended = next((place for place in self._appended if at < place < after), None) if self._appended else None
            if appended is not None:
                self.skipped += appended - at
                at = appended
                continue
            if after > end or kind not in _KINDS:
                found = self._resume(at + 1)
                self.skipped += found - at
                at = found
                continue
            following = after
            if after + _HEAD.size <= end and log[after + 2] not in _KINDS:
                following = self._resume(at + 1)
                if following < after:  # the size of this message is torn, or it is none
                    self.skipped += following - at
                    at = following
                    continue
                self.skipped += following - after
            try:
                counts = kind != _FLAGS or at == _HEADER_BYTES
                record = self._take(chr(kind), log[begin:after]) if counts else None
            except (StructError, UnicodeDecodeError, IndexError):
                record = None  # a damaged message: the next one begins where this one's size says
            if record is not None:
                yield record
            at = following
        self.skipped += end - at

    def _resume(self, begin: int) -> int:
        """Where the next whole message begins after a torn place; the end of the log if nowhere."""
        log, end = self._log, len(self._log)
        if self._mark < begin + _HEAD.size:
            found = log.find(_SYNC, begin + _HEAD.size)
            self._mark = end + _HEAD.size if found < 0 else found
        limit = self._mark - _HEAD.size
        for at in range(begin, limit):
            if log[at + 2 : at + 3] in b"DLA" and self._runs_on(at):
                return at
        return limit

    def _runs_on(self, at: int) -> bool:
        """Whether so many messages follow each other from here on that it is no chance."""
        log, end = self._log, len(self._log)
        for _ in range(_IN_A_ROW):
            if at + _HEAD.size > end:
                return False
            size, kind = _HEAD.unpack_from(log, at)
            if kind not in _KINDS or size == 0:
                return False
            at += _HEAD.size + size
            if at == end:
                return True
        return at < end

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
                self._formats.setdefault(name, [(one[1], int(one[2] or 0), one[3]) for one in found if one])
        elif kind == "B":
            if body[8] & ~_APPENDED or any(body[9:_OFFSETS_AT]):
                raise BadFlightFile("this ULog is of a newer kind that the tower cannot read")
            if body[8] & _APPENDED:
                self._appended = sorted(place for place in _OFFSETS.unpack_from(body, _OFFSETS_AT) if place)
        return None

    def _subscribe(self, instance: int, number: int, name: str) -> None:
        if name not in self._names:
            return
        if name not in self._layouts:
            self._layouts[name] = None  # also where it raises: it is tried once
            self._layouts[name] = self._layout(name)
        layout = self._layouts[name]
        if layout is not None:
            self._topics[number] = name, instance, layout

    def _layout(self, name: str) -> _Layout | None:
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
        if ("uint64_t", 0, "timestamp") not in self._formats.get(name, ()):
            return None
        return _Layout(Struct("<" + "".join(codes)), tuple(places))

    def _size(self, kind: str, depth: int) -> int:
        """Bytes of a type, found once. Raises BadFlightFile."""
        if kind in self._sizes:
            return self._sizes[kind]
        letter = _BASIC.get(kind)
        if letter is not None:
            return Struct("<" + letter).size
        if depth == 0 or kind not in self._formats:
            raise BadFlightFile(f"this ULog uses a type that it does not explain: {kind[:40]}")
        size = sum(max(count, 1) * self._size(inner, depth - 1) for inner, count, _ in self._formats[kind])
        if size > MAX_MESSAGE_BYTES:
            raise BadFlightFile(f"this ULog has a type that no message can hold: {kind[:40]}")
        self._sizes[kind] = size
        return size


def _record(name: str, instance: int, layout: _Layout, body: bytes) -> Record | None:
    values = layout.body.unpack_from(body)
    fields = {field: values[place : place + count] if count else values[place] for field, place, count in layout.fields}
    return Record(name, instance, cast(int, fields["timestamp"]), fields)
