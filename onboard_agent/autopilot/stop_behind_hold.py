"""Stops a flight to a target where asking for the hold's mode does not. Pure.

PX4 flies to a target in AUTO.LOITER. To ask for the mode that it is in changes nothing: accepted, shown, and it flew on
at 5 m/s (measured on 1.16). A reposition to no place stops it where it is. So one goes behind each request for that
mode, whoever makes it: a hold, a command, the console, a ground station.
"""

import math
from struct import Struct
from typing import Final

from onboard_agent.autopilot.flight_modes import commanded_mode
from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, command_long
from wire.autopilots.registry import FAMILIES
from wire.dialect import mavlink
from wire.frames import message_id, payload

_COMMAND: Final = Struct("<fffffffH")  # the same offsets in COMMAND_LONG and COMMAND_INT
_SET_MODE: Final = Struct("<IBB")  # custom_mode, target_system, base_mode
_CUSTOM: Final = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
_COMMANDS: Final = (mavlink.MAVLINK_MSG_ID_COMMAND_LONG, mavlink.MAVLINK_MSG_ID_COMMAND_INT)
_USUAL_SPEED: Final = -1.0
_CHANGE_MODE: Final = 1.0


def asked_mode(frame: bytes, autopilot_kind: int) -> int | None:
    """The custom_mode that a frame asks for; None: it asks for none."""
    kind = message_id(frame)
    if kind == mavlink.MAVLINK_MSG_ID_SET_MODE:
        mode, _, base = _SET_MODE.unpack_from(payload(frame).ljust(_SET_MODE.size, b"\0"))
        return int(mode) if base & _CUSTOM else None
    if kind not in _COMMANDS:
        return None
    flags, main, sub, *_, command = _COMMAND.unpack_from(payload(frame).ljust(_COMMAND.size, b"\0"))
    if command != mavlink.MAV_CMD_DO_SET_MODE:
        return None
    try:
        return commanded_mode(autopilot_kind, main, sub) if int(flags) & _CUSTOM else None
    except (ValueError, OverflowError):  # not a number, or infinite: the autopilot will refuse it
        return None


class StopBehindHold:
    """Call `add` with all that goes to the autopilot."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self.is_due = False
        """In the air: on the ground there is nothing to stop, and a place to keep."""

    def add(self, frames: list[bytes], *, autopilot_kind: int, vehicle_system_id: int | None) -> list[bytes]:
        """The frames, with a stop behind each request for a mode that does not stop by itself."""
        family = FAMILIES.get(autopilot_kind)
        if not self.is_due or family is None or not family.flies_on_in or vehicle_system_id is None:
            return frames
        found: list[bytes] = []
        for frame in frames:
            found.append(frame)
            if asked_mode(frame, autopilot_kind) in family.flies_on_in:
                found.append(self._stop(vehicle_system_id))
        return found

    def _stop(self, vehicle_system_id: int) -> bytes:
        places = (math.nan,) * 4
        stop = command_long(vehicle_system_id, mavlink.MAV_CMD_DO_REPOSITION, _USUAL_SPEED, _CHANGE_MODE, 0.0, *places)
        return self._maker.make(stop, agent_sender(vehicle_system_id))
