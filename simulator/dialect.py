"""The one door to MAVLink: the generated dialect, and a codec around it that never raises on bad input.

No other file of the package may import pymavlink.
"""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

__all__ = ["AUTOPILOT_COMPONENT", "Codec", "Message", "mavlink", "number_of"]

Message = Any
"""A pymavlink message object; the generated module has no useful static types."""

AUTOPILOT_COMPONENT = 1

RECEIVE_BUFFER_MAX = 4096
"""What one call may bring; the rest of a longer one is dropped. A UDP datagram carries at most a few frames."""


class Codec:
    """Bytes to messages and back for one vehicle on one link."""

    def __init__(self, system_id: int, component_id: int = AUTOPILOT_COMPONENT) -> None:
        self._system_id = system_id
        self._component_id = component_id
        self.bad_frames = 0
        self._restart()

    def _restart(self) -> None:
        self._mav = mavlink.MAVLink(None, self._system_id, self._component_id)
        self._mav.robust_parsing = True

    def decode(self, data: bytes) -> list[Message]:
        """The whole messages that `data` completes. Bad frames are counted and skipped."""
        try:
            parsed = self._mav.parse_buffer(data[:RECEIVE_BUFFER_MAX]) or []
        except Exception:  # other people's parser, fed by strangers: whatever it raises ends here
            self.bad_frames += 1
            sequence = self._mav.seq
            self._restart()
            self._mav.seq = sequence
            return []
        good = []
        for message in parsed:
            if message.get_type() == "BAD_DATA" or message.get_type().startswith("UNKNOWN"):
                self.bad_frames += 1
            else:
                good.append(message)
        return good

    def encode(self, message: Message) -> bytes:
        """One MAVLink 2 frame with the next sequence number."""
        packed = bytes(message.pack(self._mav))
        self._mav.seq = (self._mav.seq + 1) % 256
        return packed


def number_of(message_class: Message) -> int:
    """The message id of a generated message class."""
    return int(message_class.id)
