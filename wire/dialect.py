"""The only module that imports a MAVLink dialect. Server and agent take messages and constants from here.

The agent's own distribution carries a smaller copy of the same module (deploy/packages/agent/small_dialect.py), and
needs no pymavlink.

`mavlink` is the generated ardupilotmega module (it contains common and minimal). It is used off the hot path only, to
build and to read single messages; forwarding never decodes a payload.
"""

from importlib.util import find_spec
from struct import Struct
from typing import Any, Final

if find_spec("wire.small_ardupilotmega") is not None:
    from wire import small_ardupilotmega as _dialect  # type: ignore[attr-defined,unused-ignore]
else:
    from pymavlink.dialects.v20 import ardupilotmega as _dialect

mavlink: Any = _dialect

COMPONENT_METADATA: Final = 397
"""A message of `common` that ArduPilot's dialect lacks; `onboard_agent.transactions.metadata_general` reads it."""

EVENT: Final = 410
"""A message of `common` that the dialect lacks; `wire.autopilots.event_log` reads it."""

CURRENT_EVENT_SEQUENCE: Final = 411
REQUEST_EVENT: Final = 412
EVENT_ERROR: Final = 413
"""The others of the event interface: the newest sequence, a request for a range, and what is kept no more."""

CRC_EXTRA: Final[dict[int, int]] = {msgid: cls.crc_extra for msgid, cls in mavlink.mavlink_map.items()} | {
    COMPONENT_METADATA: 182,
    EVENT: 160,
    CURRENT_EVENT_SEQUENCE: 106,
    REQUEST_EVENT: 33,
    EVENT_ERROR: 77,
}
"""Message id to the seed byte of its checksum."""


class RequestEvent:
    """REQUEST_EVENT, as far as `build` needs a generated message."""

    _FIELDS = Struct("<HHBB")

    def __init__(self, first: int, last: int, target_system: int, target_component: int) -> None:
        """`first`, `last`: sequences, both included."""
        self._fields = (first, last, target_system, target_component)

    def pack(self, packer: Any) -> bytes:
        """As a generated message does."""
        message = mavlink.MAVLink_message(REQUEST_EVENT, "REQUEST_EVENT")
        return bytes(message._pack(packer, CRC_EXTRA[REQUEST_EVENT], self._FIELDS.pack(*self._fields)))


def build(message: Any, *, system_id: int, component_id: int, sequence: int) -> bytes:
    """Packs one message as a MAVLink 2 frame (never signed; not for the hot path: about 7 microseconds)."""
    packer = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
    packer.seq = sequence & 0xFF
    return bytes(message.pack(packer))


def decode(frame: bytes) -> Any | None:
    """Decodes one whole, already checked frame; None if the dialect does not know or accept the message."""
    reader = mavlink.MAVLink(None)
    reader.robust_parsing = True
    try:
        message = reader.parse_char(frame)
    except (mavlink.MAVError, ValueError, IndexError):
        return None
    if message is None or message.get_type() in ("BAD_DATA", "UNKNOWN") or message.get_msgId() < 0:
        return None
    return message
