"""One request or answer of MAVLink FTP: the payload of FILE_TRANSFER_PROTOCOL. Pure.

Source: mavlink.io, services/ftp; ArduPilot's GCS_FTP where that leaves the choice to the server.
"""

from dataclasses import dataclass
from enum import IntEnum
from struct import Struct
from typing import Any, Final

from onboard_agent.autopilot.own_frames import AGENT_COMPONENT, FrameMaker, Sender
from wire.dialect import mavlink

_HEAD: Final = Struct("<HBBBBBxI")
"""Sequence, session, opcode, size, opcode of the request, whether a burst is over, offset."""
MAX_BLOCK_BYTES: Final = 239
_PAYLOAD_BYTES: Final = _HEAD.size + MAX_BLOCK_BYTES
_AUTOPILOT_COMPONENT: Final = 1


class Op(IntEnum):
    TERMINATE = 1
    OPEN_TO_READ = 4
    READ = 5
    ACK = 128
    NACK = 129


class Nack(IntEnum):
    """The first byte of a NACK's payload."""

    FAIL = 1
    INVALID_SESSION = 4
    END_OF_FILE = 6


@dataclass(frozen=True, slots=True)
class FileAnswer:
    """`sequence`: one more than that of the request. `code`: of a NACK, else None."""

    sequence: int
    session: int
    data: bytes
    code: int | None


def read_answer(message: Any, system_id: int, component: int = AGENT_COMPONENT) -> FileAnswer | None:
    """The answer in a FILE_TRANSFER_PROTOCOL; None if it is for somebody else, or not an answer. `component`: the
    requester."""
    if (message.target_system, message.target_component) != (system_id, component):
        return None
    payload = bytes(message.payload).ljust(_PAYLOAD_BYTES, b"\0")
    sequence, session, op, size, _, _, _ = _HEAD.unpack_from(payload)
    if op not in (Op.ACK, Op.NACK) or size > MAX_BLOCK_BYTES:
        return None
    data = payload[_HEAD.size : _HEAD.size + size]
    code = (data[0] if data else int(Nack.FAIL)) if op == Op.NACK else None
    return FileAnswer(sequence, session, data, code)


class FileFrames:
    """Makes the frames for one vehicle. `component`: under which they go, and to which the answers come."""

    def __init__(self, maker: FrameMaker, *, vehicle_system_id: int, component: int = AGENT_COMPONENT) -> None:
        self._maker = maker
        self._sender = Sender(vehicle_system_id, component)
        self.system_id = vehicle_system_id

    def ask(self, op: Op, *, sequence: int, session: int, offset: int = 0, size: int = 0, data: bytes = b"") -> bytes:
        """A request. `size`: of the requested block; with `data`, its length counts."""
        head = _HEAD.pack(sequence & 0xFFFF, session, op, len(data) or size, 0, 0, offset)
        payload = (head + data).ljust(_PAYLOAD_BYTES, b"\0")
        message = mavlink.MAVLink_file_transfer_protocol_message(0, self.system_id, _AUTOPILOT_COMPONENT, payload)
        return self._maker.make(message, self._sender)
