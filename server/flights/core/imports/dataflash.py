"""Reads ArduPilot's dataflash log (`.bin`), which describes itself. Pure.

Every message begins with A3 95 and its type. FMT (type 128) names another type: its length, its name, one letter for
each field, and the names of the fields. Source: ArduPilot, libraries/AP_Logger/LogStructure.h.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from mmap import mmap
from struct import Struct
from typing import Final, NamedTuple

from server.flights.core.imports.refusals import BadFlightFile

HEAD: Final = b"\xa3\x95"
FMT: Final = 128
FMT_BODY: Final = Struct("<BB4s16s64s")
_HEAD_BYTES: Final = 3
_LETTERS: Final = {
    **dict.fromkeys("b", "b"),
    **dict.fromkeys("BM", "B"),
    **dict.fromkeys("hc", "h"),
    **dict.fromkeys("HC", "H"),
    **dict.fromkeys("ieL", "i"),
    **dict.fromkeys("IE", "I"),
    "q": "q",
    "Q": "Q",
    "f": "f",
    "d": "d",
    "g": "e",
    "n": "4s",
    "N": "16s",
    "Z": "64s",
    "a": "64s",
}
_HUNDREDTHS: Final = frozenset("cCeE")
_DEGREES_E7: Final = "L"

Value = float | int | str
Buffer = bytes | mmap


class Record(NamedTuple):
    """One message: its name, and its fields in the units of the log (degrees, metres, volts)."""

    name: str
    fields: dict[str, Value]


class _Layout(NamedTuple):
    name: str
    length: int
    letters: str
    fields: tuple[str, ...]
    body: Struct | None
    """None: the format is inconsistent; its messages are skipped by their length."""


class DataflashReader:
    """Reads the messages of these names and steps over the rest. `skipped`: bytes that belong to no message."""

    def __init__(self, log: Buffer, names: Collection[str]) -> None:
        self._log = log
        self._names = names
        self.skipped = 0

    def __iter__(self) -> Iterator[Record]:
        """In the order of the file, up to the last whole message. Raises BadFlightFile."""
        log, end = self._log, len(self._log)
        if log[:_HEAD_BYTES] != HEAD + bytes((FMT,)):
            raise BadFlightFile("this is no dataflash log of ArduPilot: it does not begin with a format")
        layouts: dict[int, _Layout] = {FMT: _Layout("FMT", _HEAD_BYTES + FMT_BODY.size, "", (), None)}
        at = 0
        while at + _HEAD_BYTES <= end:
            layout = layouts.get(log[at + 2]) if log[at : at + 2] == HEAD else None
            if layout is None:
                found = log.find(HEAD, at + 1)
                after = found if found >= 0 else end
                self.skipped += after - at
                at = after
                continue
            after = at + layout.length
            if after > end:
                break
            if log[at + 2] == FMT:
                self._add(layouts, log[at + _HEAD_BYTES : after])
            elif layout.body is not None and layout.name in self._names:
                yield Record(layout.name, _fields(layout, log[at + _HEAD_BYTES : after]))
            at = after
        self.skipped += end - at

    def _add(self, layouts: dict[int, _Layout], body: bytes) -> None:
        number, length, name, letters, labels = FMT_BODY.unpack(body)
        if number == FMT or length < _HEAD_BYTES:
            return
        fields = tuple(_text(labels).split(","))
        kinds = _text(letters)
        codes = [_LETTERS.get(letter, "") for letter in kinds]
        layout: Struct | None = Struct("<" + "".join(codes)) if all(codes) else None
        if layout is not None and (layout.size != length - _HEAD_BYTES or len(fields) != len(kinds)):
            layout = None
        layouts[number] = _Layout(_text(name), length, kinds, fields, layout)


def _fields(layout: _Layout, body: bytes) -> dict[str, Value]:
    assert layout.body is not None
    found: dict[str, Value] = {}
    for name, letter, value in zip(layout.fields, layout.letters, layout.body.unpack(body), strict=True):
        if isinstance(value, bytes):
            found[name] = _text(value)
        elif letter in _HUNDREDTHS:
            found[name] = value / 100
        elif letter == _DEGREES_E7:
            found[name] = value / 1e7
        else:
            found[name] = value
    return found


def _text(field: bytes) -> str:
    return field.split(b"\0", 1)[0].decode("ascii", "replace")
