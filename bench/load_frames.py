"""Frames that carry their sending time and number: the content of the load, checked at the other end.

They have the ids, the lengths and the checksums of real messages. The first twelve bytes of the payload, which nothing
on the path reads, are the sender's clock (u64, microseconds) and a number (u32): per drone, 1, 2, 3, ... for
transactional frames, 0 for state (of a position: its longitude).
"""

from __future__ import annotations

from collections.abc import Iterator
from struct import Struct
from typing import Final, NamedTuple

from fastcrc.crc16 import mcrf4xx

from wire.dialect import CRC_EXTRA, mavlink
from wire.tagged import TAG_BYTES

STATE_KINDS: Final = (
    mavlink.MAVLINK_MSG_ID_ATTITUDE,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    mavlink.MAVLINK_MSG_ID_VFR_HUD,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT,
    mavlink.MAVLINK_MSG_ID_RC_CHANNELS,
    mavlink.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT,
    mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT,
    mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT,
    mavlink.MAVLINK_MSG_ID_WIND,
)
"""A browser keeps only the newest of these; none has an instance number among the first twelve bytes."""

EVENT_KINDS: Final = (
    mavlink.MAVLINK_MSG_ID_PARAM_VALUE,
    mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT,
    mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
    mavlink.MAVLINK_MSG_ID_MISSION_ITEM,
)
"""Transactional: every single one must arrive, in order, at once. None is a text: the stamp would be its severity, and
the alerts would store what the load says."""

_EVENTS: Final = frozenset(EVENT_KINDS)

_HEAD: Final = Struct("<BBBBBBBBBBQI")
_STAMP: Final = Struct("<QI")
_TAG: Final = Struct("<I")
_HEIGHT: Final = Struct("<i")
"""Of GLOBAL_POSITION_INT, in mm; it follows the stamp."""
LAYERS: Final = 150
_COLUMN_E7: Final = 200_000
_FRAME_HEADER_BYTES: Final = 10

_REST: Final[dict[int, tuple[int, bytes, bytes]]] = {
    msgid: (
        mavlink.mavlink_map[msgid].unpacker.size,
        bytes(mavlink.mavlink_map[msgid].unpacker.size - _STAMP.size),
        bytes((CRC_EXTRA[msgid],)),
    )
    for msgid in (*STATE_KINDS, *EVENT_KINDS)
}


class Arrived(NamedTuple):
    """One frame as it arrived at the other end."""

    drone_id: int
    message_id: int
    sent_us: int
    number: int


def stamped_frame(message_id: int, sent_us: int, number: int, sequence: int, layer: int = 0) -> bytes:
    """Returns one whole MAVLink 2 frame of one of the kinds above, from system 1, component 1. The stamps put all
    drones of the load at one place: each has its own `layer`, 50 m above the next, so that none is near another. Beyond
    LAYERS the next ones are 2 km further east: no drone flies higher than drones do. The number of a position is its
    longitude."""
    length, rest, extra = _REST[message_id]
    if message_id == mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT:
        column, height = divmod(layer, LAYERS)
        rest = _HEIGHT.pack(50_000 * height) + rest[_HEIGHT.size :]
        number = column * _COLUMN_E7
    head = _HEAD.pack(0xFD, length, 0, 0, sequence & 0xFF, 1, 1, message_id & 0xFF, message_id >> 8, 0, sent_us, number)
    body = head + rest
    return body + mcrf4xx(body[1:] + extra).to_bytes(2, "little")


def read_tagged(message: bytes) -> Iterator[Arrived]:
    """Yields the stamped frames of one message to a browser; other frames are left out."""
    at, end = 0, len(message)
    while at < end:
        (drone_id,) = _TAG.unpack_from(message, at)
        at += TAG_BYTES
        msgid = message[at + 7] | message[at + 8] << 8
        if msgid in _REST:
            sent_us, number = _STAMP.unpack_from(message, at + _FRAME_HEADER_BYTES)
            yield Arrived(drone_id, msgid, sent_us, number if msgid in _EVENTS else 0)
        at += message[at + 1] + 12


def read_plain(datagram: bytes) -> Iterator[Arrived]:
    """Yields the stamped frames of a datagram without tags. All of them count as drone 0."""
    at, end = 0, len(datagram)
    while at < end:
        msgid = datagram[at + 7] | datagram[at + 8] << 8
        if msgid in _REST:
            sent_us, number = _STAMP.unpack_from(datagram, at + _FRAME_HEADER_BYTES)
            yield Arrived(0, msgid, sent_us, number if msgid in _EVENTS else 0)
        at += datagram[at + 1] + 12
