"""MPEG-TS around MPEG-1 pictures: whole packets for each, so that units can be cut, skipped and joined (no I/O).

FFmpeg's muxer is not used: it writes its tables by the clock, or before every picture (72 kbit/s at 24 Hz), but not
just before the key pictures, where a new reader begins. After ISO/IEC 13818-1, 2.4.3 and 2.4.4.
"""

from struct import Struct
from typing import Final

PACKET_BYTES: Final = 188
_PROGRAMME: Final = 1
_TABLE_PID: Final = 0x1000
_VIDEO_PID: Final = 0x100
_MPEG1_VIDEO: Final = 0x01
_VIDEO_STREAM: Final = 0xE0

_SYNC: Final = 0x47
_START: Final = 0x40
_PAYLOAD: Final = 0x10
_ADAPTATION: Final = 0x20
_RANDOM_ACCESS: Final = 0x40
_HAS_PCR: Final = 0x10

_HEADER: Final = Struct(">BHB")
_HEADER_BYTES: Final = _HEADER.size
_CARRIED_BYTES: Final = PACKET_BYTES - _HEADER_BYTES
_PCR_FIELD_BYTES: Final = 8
_PES_HEADER_BYTES: Final = 14
_PES_COUNTED_BYTES: Final = 8
"""Bytes of the PES header that its length field counts."""
_MAX_PES_PAYLOAD_BYTES: Final = 0xFFFF - _PES_COUNTED_BYTES

_CLOCK_BITS: Final = 33
_DECODER_SLACK: Final = 9_000
"""How far the clock reference precedes the picture's time: 100 ms at 90 kHz, the time a decoder may take to receive a
picture. Players that pace by it get that much buffer; ours ignores it."""


def _crc(section: bytes) -> bytes:
    crc = 0xFFFFFFFF
    for byte in section:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1 ^ (0x04C11DB7 if crc & 0x80000000 else 0)) & 0xFFFFFFFF
    return crc.to_bytes(4)


def _section(table_id: int, body: bytes) -> bytes:
    """A table in the payload of one packet: pointer, header, body, checksum, stuffing."""
    numbered = b"\x00\x01\xc1\x00\x00" + body
    head = bytes([table_id]) + (0xB000 | len(numbered) + 4).to_bytes(2)
    section = head + numbered
    return (b"\x00" + section + _crc(section)).ljust(_CARRIED_BYTES, b"\xff")


_PROGRAMMES: Final = _section(0x00, _PROGRAMME.to_bytes(2) + (0xE000 | _TABLE_PID).to_bytes(2))
_STREAMS: Final = _section(
    0x02,
    (0xE000 | _VIDEO_PID).to_bytes(2)
    + b"\xf0\x00"
    + bytes([_MPEG1_VIDEO])
    + (0xE000 | _VIDEO_PID).to_bytes(2)
    + b"\xf0\x00",
)


def room_for_picture(unit_bytes: float) -> float:
    """Size of an encoded picture, in bytes, whose packets average `unit_bytes`: half a packet is stuffing. May be
    negative."""
    in_packets = unit_bytes / PACKET_BYTES * _CARRIED_BYTES
    return in_packets - _PCR_FIELD_BYTES - _PES_HEADER_BYTES - _CARRIED_BYTES / 2


TABLE_BYTES: Final = 2 * PACKET_BYTES
"""Additional size of a key picture."""


class TransportStream:
    """Packs the pictures of one stream. Its only state is the counters that continue from packet to packet."""

    def __init__(self) -> None:
        self._video_counter = 0
        self._tables_counter = 0

    def pack(self, picture: bytes, *, key: bool, at_us: int) -> bytes:
        """Returns whole packets with `picture`, preceded by the tables if it is a key picture.

        A picture above 65,527 bytes is split into two or more PES packets, of which only the first has a time.
        """
        clock = at_us * 9 // 100
        packets = self._tables() if key else bytearray()
        for begin in range(0, len(picture), _MAX_PES_PAYLOAD_BYTES):
            part = picture[begin : begin + _MAX_PES_PAYLOAD_BYTES]
            self._pack_pes(packets, part, clock=clock if begin == 0 else None, key=key and begin == 0)
        return bytes(packets)

    def _tables(self) -> bytearray:
        counter = self._tables_counter
        self._tables_counter = counter + 1 & 0xF
        packets = bytearray(_HEADER.pack(_SYNC, _START << 8, _PAYLOAD | counter) + _PROGRAMMES)
        packets += _HEADER.pack(_SYNC, _START << 8 | _TABLE_PID, _PAYLOAD | counter) + _STREAMS
        return packets

    def _pack_pes(self, packets: bytearray, part: bytes, *, clock: int | None, key: bool) -> None:
        pes = memoryview(_pes_header(len(part), clock) + part)
        adaptation = b"" if clock is None else _clock_reference(clock, key=key)
        start = _START << 8
        at = 0
        while at < len(pes):
            room = _CARRIED_BYTES - len(adaptation)
            missing = room - (len(pes) - at)
            if missing > 0:
                adaptation = _stuffed(adaptation, missing)
                room -= missing
            control = _PAYLOAD | (_ADAPTATION if adaptation else 0) | self._video_counter
            packets += _HEADER.pack(_SYNC, start | _VIDEO_PID, control)
            packets += adaptation
            packets += pes[at : at + room]
            self._video_counter = self._video_counter + 1 & 0xF
            at += room
            start = 0
            adaptation = b""


def _pes_header(payload_bytes: int, clock: int | None) -> bytes:
    """Has a constant length: without a time, stuffing takes its place."""
    length = (payload_bytes + _PES_COUNTED_BYTES).to_bytes(2)
    if clock is None:
        return b"\x00\x00\x01" + bytes([_VIDEO_STREAM]) + length + b"\x80\x00\x05" + b"\xff" * 5
    clock &= (1 << _CLOCK_BITS) - 1
    time = bytes([0x21 | clock >> 29 & 0x0E])
    time += (clock >> 14 & 0xFFFE | 1).to_bytes(2) + (clock << 1 & 0xFFFE | 1).to_bytes(2)
    return b"\x00\x00\x01" + bytes([_VIDEO_STREAM]) + length + b"\x84\x80\x05" + time


def _clock_reference(clock: int, *, key: bool) -> bytes:
    base = clock - _DECODER_SLACK & (1 << _CLOCK_BITS) - 1
    flags = _HAS_PCR | (_RANDOM_ACCESS if key else 0)
    return bytes([_PCR_FIELD_BYTES - 1, flags]) + (base << 15 | 0x7E00).to_bytes(6)


def _stuffed(adaptation: bytes, missing: int) -> bytes:
    """Extends the adaptation field by `missing` bytes (at least 1)."""
    if not adaptation:
        adaptation, missing = b"\x00", missing - 1
        if missing == 0:
            return adaptation
        adaptation, missing = b"\x01\x00", missing - 1
    return bytes([adaptation[0] + missing]) + adaptation[1:] + b"\xff" * missing
