"""The only access to MAVLink: the generated dialect, and a codec around it that never raises on bad input.

No other module of the package may import pymavlink.
"""

from __future__ import annotations

import struct
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

__all__ = [
    "AUTOPILOT_COMPONENT",
    "COMPONENT_METADATA",
    "Codec",
    "ComponentMetadata",
    "Event",
    "EventError",
    "EventSequence",
    "Message",
    "RequestEvent",
    "mavlink",
    "number_of",
]

Message = Any
"""A pymavlink message object; the generated module has no useful static types."""

AUTOPILOT_COMPONENT = 1

COMPONENT_METADATA = 397
EVENT = 410
CURRENT_EVENT_SEQUENCE = 411
REQUEST_EVENT = 412
EVENT_ERROR = 413

RECEIVE_BUFFER_MAX = 4096
"""The limit for one call; the rest is dropped. A UDP datagram carries at most a few frames."""


class Codec:
    """Converts bytes to messages and back for one vehicle on one link."""

    def __init__(self, system_id: int, component_id: int = AUTOPILOT_COMPONENT) -> None:
        self._system_id = system_id
        self._component_id = component_id
        self.bad_frames = 0
        self._signing = mavlink.MAVLinkSigning()
        self._restart()

    def _restart(self) -> None:
        self._mav = mavlink.MAVLink(None, self._system_id, self._component_id)
        self._mav.robust_parsing = True
        self._mav.signing = self._signing

    def sign(self, key: bytes, timestamp: int) -> None:
        """Signs all frames and takes only signed ones from now on; no key ends that."""
        self._signing.secret_key = key or None
        self._signing.sign_outgoing = bool(key)
        self._signing.timestamp = timestamp

    def decode(self, data: bytes) -> list[Message]:
        """Returns the whole messages that `data` completes. Bad frames are counted and skipped."""
        try:
            parsed = self._mav.parse_buffer(data[:RECEIVE_BUFFER_MAX]) or []
        except Exception:  # a third-party parser with untrusted input: it may raise anything
            self.bad_frames += 1
            sequence = self._mav.seq
            self._restart()
            self._mav.seq = sequence
            return []
        good = []
        for message in parsed:
            if message.get_type() == f"UNKNOWN_{REQUEST_EVENT}":
                good.append(RequestEvent(message))
            elif message.get_type() == "BAD_DATA" or message.get_type().startswith("UNKNOWN"):
                self.bad_frames += 1
            else:
                good.append(message)
        return good

    def encode(self, message: Message) -> bytes:
        """Returns one MAVLink 2 frame with the next sequence number."""
        packed = bytes(message.pack(self._mav))
        self._mav.seq = (self._mav.seq + 1) % 256
        return packed


def number_of(message_class: Message) -> int:
    """Returns the message id of a generated message class."""
    return int(message_class.id)


class ComponentMetadata:
    """COMPONENT_METADATA, which this dialect lacks: imitates a generated message as far as `Codec.encode` needs it."""

    _CRC_EXTRA = 182
    _FIELDS = struct.Struct("<II100s")

    def __init__(self, time_boot_ms: int, file_crc: int, uri: bytes) -> None:
        self._payload = self._FIELDS.pack(time_boot_ms, file_crc, uri)

    def get_type(self) -> str:
        return "COMPONENT_METADATA"

    def pack(self, mav: Any) -> bytes:
        frame = mavlink.MAVLink_message(COMPONENT_METADATA, self.get_type())
        return bytes(frame._pack(mav, self._CRC_EXTRA, self._payload))


class Event:
    """EVENT (410), which this dialect lacks: imitates a generated message as far as `Codec.encode` needs it."""

    _CRC_EXTRA = 160
    _FIELDS = struct.Struct("<IIHBBB40s")
    _LEVELS = 0x22
    """Critical, in the log and for people."""

    def __init__(self, number: int, arguments: bytes) -> None:
        self.number, self.arguments = number, arguments
        self.time_boot_ms = self.sequence = 0

    def get_type(self) -> str:
        return "EVENT"

    def pack(self, mav: Any) -> bytes:
        frame = mavlink.MAVLink_message(EVENT, self.get_type())
        fields = (self.number, self.time_boot_ms, self.sequence, 0, 0, self._LEVELS, self.arguments)
        return bytes(frame._pack(mav, self._CRC_EXTRA, self._FIELDS.pack(*fields)))


class EventSequence:
    """CURRENT_EVENT_SEQUENCE (411): the newest event that was sent."""

    _CRC_EXTRA = 106
    _FIELDS = struct.Struct("<HB")

    def __init__(self, sequence: int, *, is_reset: bool) -> None:
        self._fields = (sequence, int(is_reset))

    def get_type(self) -> str:
        return "CURRENT_EVENT_SEQUENCE"

    def pack(self, mav: Any) -> bytes:
        frame = mavlink.MAVLink_message(CURRENT_EVENT_SEQUENCE, self.get_type())
        return bytes(frame._pack(mav, self._CRC_EXTRA, self._FIELDS.pack(*self._fields)))


class EventError:
    """RESPONSE_EVENT_ERROR (413): an event that was asked for is kept no more."""

    _CRC_EXTRA = 77
    _FIELDS = struct.Struct("<HHBBB")

    def __init__(self, sequence: int, oldest: int, system_id: int, component_id: int) -> None:
        self._fields = (sequence, oldest, system_id, component_id, 0)

    def get_type(self) -> str:
        return "RESPONSE_EVENT_ERROR"

    def pack(self, mav: Any) -> bytes:
        frame = mavlink.MAVLink_message(EVENT_ERROR, self.get_type())
        return bytes(frame._pack(mav, self._CRC_EXTRA, self._FIELDS.pack(*self._fields)))


class RequestEvent:
    """REQUEST_EVENT (412), as the dialect gives it: unread."""

    _FIELDS = struct.Struct("<HHBB")

    def __init__(self, unread: Message) -> None:
        frame = bytes(unread.data)
        body = frame[10 : 10 + frame[1]][: self._FIELDS.size].ljust(self._FIELDS.size, b"\0")
        self.first_sequence, self.last_sequence, self.target_system, self.target_component = self._FIELDS.unpack(body)
        self._source = (frame[5], frame[6])

    def get_type(self) -> str:
        return "REQUEST_EVENT"

    def get_srcSystem(self) -> int:
        return self._source[0]

    def get_srcComponent(self) -> int:
        return self._source[1]
