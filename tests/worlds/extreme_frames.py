"""Frames with extreme values in every field: what an autopilot with a broken estimator, or a hostile one, may send."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final

from hypothesis import strategies as st

from wire.dialect import CRC_EXTRA, EVENT, mavlink

_CHECKOUT: Final = Path(__file__).resolve().parents[2]
_READERS: Final = ("onboard_agent", "server", "wire")

EVERY_MESSAGE: Final = sorted(set(mavlink.mavlink_map) - {mavlink.MAVLINK_MSG_ID_SETUP_SIGNING})
"""Neither side passes the one that is left out."""

_WORDS: Final = (
    bytes(4),
    b"\xff" * 4,
    struct.pack("<i", 2**31 - 1),
    struct.pack("<i", -(2**31)),
    struct.pack("<f", float("nan")),
    struct.pack("<f", float("inf")),
    struct.pack("<f", float("-inf")),
    struct.pack("<f", 3.4e38),
    struct.pack("<i", 950_000_000),  # 95 degrees
    struct.pack("<i", -1_900_000_000),
    struct.pack("<hh", -32768, 32767),
)
"""MAVLink puts wide fields first, so that each field of four bytes is one of these."""

_FLOATS: Final = ("nan", "inf", "-inf", "3.4e38", "-3.4e38", "1e-45", "-0.0", "0.0")
_FORMATS: Final = {
    "char": "c", "uint8_t": "B", "int8_t": "b", "uint16_t": "H", "int16_t": "h", "uint32_t": "I", "int32_t": "i",
    "uint64_t": "Q", "int64_t": "q", "float": "f", "double": "d",
}  # fmt: skip
_TEXTS: Final = (b"\xff\xfe\x80", b"\xed\xa0\x80", b"{", b"%", b"A", b"\n", b"\x01", "空".encode(), b"<b>", b"\x00A")


@cache
def messages_read() -> tuple[int, ...]:
    """The numbers of all messages that the code of tower, agent or wire names, from its text."""
    named: set[str] = set()
    for folder in _READERS:
        for file in (_CHECKOUT / folder).rglob("*.py"):
            named |= set(re.findall(r"MAVLINK_MSG_ID_(\w+)", file.read_text()))
    begun = tuple(name for name in named if name.endswith("_"))  # an f-string has the rest
    return tuple(
        number
        for number in EVERY_MESSAGE
        if (name := mavlink.mavlink_map[number].msgname) in named or (begun and name.startswith(begun))
    )


def frame_of(number: int, payload: bytes, *, system_id: int = 1, component_id: int = 1) -> bytes:
    """A whole frame of version 2 with this payload."""
    header = bytes([len(payload), 0, 0, 0, system_id, component_id]) + number.to_bytes(3, "little")
    crc = mavlink.x25crc(header + payload + bytes([CRC_EXTRA[number]])).crc
    return b"\xfd" + header + payload + crc.to_bytes(2, "little")


def frame_of_version_1(number: int, payload: bytes, *, system_id: int = 1, component_id: int = 1) -> bytes:
    """The same of version 1, which has no extensions and the numbers to 255."""
    header = bytes([len(payload), 0, system_id, component_id, number])
    crc = mavlink.x25crc(header + payload + bytes([CRC_EXTRA[number]])).crc
    return b"\xfe" + header + payload + crc.to_bytes(2, "little")


def usual_payload(number: int) -> bytes:
    """Values that a healthy copter over the middle of Switzerland might send, in all fields."""
    message = mavlink.mavlink_map[number]
    values: list[Any] = []
    for at, name in enumerate(message.ordered_fieldnames):
        kind, count = _field(message, at)
        if kind == "char":
            values.append(b"A" * min(3, count))
        elif kind in ("float", "double"):
            values += [1.0] * count
        else:
            values += [_USUAL.get(name, 1)] * count
    return bytes(struct.pack(message.unpacker.format, *values))


_USUAL: Final = {
    "lat": 473_977_420, "lon": 85_455_940, "latitude": 473_977_420, "longitude": 85_455_940, "alt": 20_000,
    "base_mode": 0x81, "type": 2, "autopilot": 3, "custom_mode": 5, "system_status": 4, "mavlink_version": 3,
    "target_system": 0, "target_component": 0, "fix_type": 3, "severity": 2,
}  # fmt: skip


def extremes(number: int) -> Iterator[tuple[str, bytes]]:
    """(name of the field and value, payload): one field of the message is extreme, or all of its kind; and payloads of
    every length from one that is cut off."""
    message = mavlink.mavlink_map[number]
    usual = usual_payload(number)
    offset = 0
    for at, name in enumerate(message.ordered_fieldnames):
        kind, count = _field(message, at)
        size = count if kind == "char" else count * struct.calcsize("<" + _FORMATS[kind])
        for word, value in _values(kind, count):
            yield f"{name}={word}", usual[:offset] + value + usual[offset + size :]
        offset += size
    for size in {1, len(usual) // 2, len(usual) - 1}:
        yield f"{size} bytes", usual[: max(1, size)]
    yield "too long", (usual + b"\xff" * 255)[:255]
    for word in _WORDS:
        yield f"all {word.hex()}", (word * 64)[: len(usual)]


def _field(message: Any, at: int) -> tuple[str, int]:
    """Type and number of values of a field, by its place in the payload."""
    place = message.orders.index(at)
    kind = message.fieldtypes[place]
    return kind, max(1, message.array_lengths[at])


def _values(kind: str, count: int) -> Iterator[tuple[str, bytes]]:
    if kind == "char":
        for text in _TEXTS:
            yield repr(text), (text * count)[:count]
        yield "empty", bytes(count)
        return
    form = _FORMATS[kind]
    if kind in ("float", "double"):
        for word in _FLOATS:
            yield word, struct.pack(f"<{count}{form}", *([float(word)] * count))
        return
    bits = 8 * struct.calcsize(form)
    is_signed = form.islower()
    most = 2 ** (bits - is_signed) - 1
    numbers = {0, 1, 2, 127, 200, most, most - 1, -(most + 1) if is_signed else most // 2, -1 if is_signed else most}
    if bits == 32:
        numbers |= {950_000_000, 1_900_000_000} | ({-950_000_000, -1_900_000_000} if is_signed else set())
    for value in sorted(one for one in numbers if -(most + 1) * is_signed <= one <= most):
        yield str(value), struct.pack(f"<{count}{form}", *([value] * count))


@st.composite
def extreme_frames(draw: st.DrawFn, numbers: st.SearchStrategy[int]) -> bytes:
    """One frame of a drawn message, from a drawn sender: each word of the payload is extreme, or random, and perhaps
    the payload ends early."""
    number = draw(numbers)
    size: int = mavlink.mavlink_map[number].unpacker.size
    words = draw(
        st.lists(st.one_of(st.sampled_from(_WORDS), st.binary(min_size=4, max_size=4)), min_size=1, max_size=8)
    )
    payload = b"".join(words[at % len(words)] for at in range(size // 4 + 1))[:size]
    payload = payload[: draw(st.one_of(st.just(size), st.integers(1, size)))]
    system_id = draw(st.one_of(st.just(1), st.sampled_from((0, 2, 255))))
    component_id = draw(st.one_of(st.just(1), st.sampled_from((0, 100, 154, 156, 190, 191, 220, 236, 255))))
    return frame_of(number, payload, system_id=system_id, component_id=component_id)


@st.composite
def events_of_px4(draw: st.DrawFn) -> bytes:
    """One EVENT, which the dialect lacks."""
    payload = draw(st.binary(min_size=1, max_size=53))
    return frame_of(EVENT, payload)
