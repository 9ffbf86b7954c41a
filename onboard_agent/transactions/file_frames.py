"""Requests and answers of MAVLink FTP: the payload of FILE_TRANSFER_PROTOCOL. Pure.

Source: mavlink.io, services/ftp; ArduPilot's GCS_FTP where the specification leaves the choice to the server.
"""

from dataclasses import dataclass
from enum import IntEnum
from struct import Struct
from typing import Any, Final

from onboard_agent.autopilot.own_frames import AGENT_COMPONENT, FrameMaker, Sender
from wire.dialect import mavlink

_HEAD: Final = Struct("<HBBBBBxI")
"""Sequence, session, opcode, size, opcode of the request, burst complete, offset."""
MAX_BLOCK_BYTES: Final = 239
_PAYLOAD_BYTES: Final = _HEAD.size + MAX_BLOCK_BYTES
_AUTOPILOT_COMPONENT: Final = 1


class Op(IntEnum):
    TERMINATE = 1
    LIST = 3
    OPEN_TO_READ = 4
    READ = 5
    CHECKSUM = 14
    BURST = 15
    ACK = 128
    NACK = 129


class Nack(IntEnum):
    """The first data byte of a NACK."""

    FAIL = 1
    INVALID_SESSION = 4
    END_OF_FILE = 6


@dataclass(frozen=True, slots=True)
class FileAnswer:
    """`sequence`: that of the request plus one, and one more for each further piece of a burst. `code`: the error of a
    NACK, else None. `is_last`: the burst ends with it."""

    sequence: int
    session: int
    data: bytes
    code: int | None
    offset: int = 0
    is_last: bool = False


def read_answer(message: Any, system_id: int, component: int = AGENT_COMPONENT) -> FileAnswer | None:
    """Reads a FILE_TRANSFER_PROTOCOL; None if it is not an answer to `component` of this system."""
    if (message.target_system, message.target_component) != (system_id, component):
        return None
    payload = bytes(message.payload).ljust(_PAYLOAD_BYTES, b"\0")
    sequence, session, op, size, _, is_last, offset = _HEAD.unpack_from(payload)
    if op not in (Op.ACK, Op.NACK) or size > MAX_BLOCK_BYTES:
        return None
    data = payload[_HEAD.size : _HEAD.size + size]
    code = (data[0] if data else int(Nack.FAIL)) if op == Op.NACK else None
    return FileAnswer(sequence, session, data, code, offset, bool(is_last))


class FileFrames:
    """Makes the frames for one vehicle. `component` sends the requests and receives the answers."""

    def __init__(self, maker: FrameMaker, *, vehicle_system_id: int, component: int = AGENT_COMPONENT) -> None:
        self._maker = maker
        self._sender = Sender(vehicle_system_id, component)
        self.system_id = vehicle_system_id

    def ask(self, op: Op, *, sequence: int, session: int, offset: int = 0, size: int = 0, data: bytes = b"") -> bytes:
        """Makes a request. `size`: of the requested block; if there is `data`, its length is used instead."""
        head = _HEAD.pack(sequence & 0xFFFF, session, op, len(data) or size, 0, 0, offset)
        payload = (head + data).ljust(_PAYLOAD_BYTES, b"\0")
        message = mavlink.MAVLink_file_transfer_protocol_message(0, self.system_id, _AUTOPILOT_COMPONENT, payload)
        return self._maker.make(message, self._sender)
