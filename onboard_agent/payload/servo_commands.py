"""Carries out MAV_CMD_DO_SET_SERVO for the servos of the companion computer. Pure: frames in, acknowledgements out.

A servo's number here is one that the autopilot does not have. The answer has the autopilot's ids, because the command
is addressed to it. Everything else passes to the autopilot untouched.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from struct import Struct
from typing import Any, Final

from onboard_agent.autopilot.own_frames import FrameMaker, Sender
from onboard_agent.payload.servo import Servo
from wire.dialect import decode, mavlink
from wire.frames import message_id, payload

Move = Callable[[Servo, float], None]
"""Moves a servo to a pulse. Raises OSError."""

_COMMAND_LONG: Final = int(mavlink.MAVLINK_MSG_ID_COMMAND_LONG)
_COMMAND: Final = Struct("<H")
_COMMAND_AT: Final = 28
_DO_SET_SERVO: Final = int(mavlink.MAV_CMD_DO_SET_SERVO)


class ServoCommands:
    """`take` each frame to the autopilot."""

    def __init__(self, servos: Sequence[Servo], move: Move) -> None:
        self._servos = {servo.number: servo for servo in servos}
        self._move = move
        self._maker = FrameMaker()
        self.failure = ""
        """Why the last command failed; empty if it did not."""

    def take(self, frame: bytes, system_id: int) -> bytes | None:
        """Returns the COMMAND_ACK if the command was for one of the servos; None: it is the autopilot's."""
        if message_id(frame) != _COMMAND_LONG or len(data := payload(frame)) < _COMMAND_AT + _COMMAND.size:
            return None
        if _COMMAND.unpack_from(data, _COMMAND_AT)[0] != _DO_SET_SERVO:
            return None
        message = decode(frame)
        if message is None or message.target_system not in (0, system_id):
            return None
        servo = self._servos.get(message.param1)
        return None if servo is None else self._answer(message, servo, system_id)

    def _answer(self, message: Any, servo: Servo, system_id: int) -> bytes:
        self.failure = ""
        result = mavlink.MAV_RESULT_ACCEPTED
        if not servo.takes(message.param2):
            result = mavlink.MAV_RESULT_DENIED
            self.failure = f"servo {servo.number} takes {servo.low_us} to {servo.high_us} us, not {message.param2:g}"
        else:
            try:
                self._move(servo, message.param2)
            except OSError as error:
                result = mavlink.MAV_RESULT_FAILED
                self.failure = f"servo {servo.number}: {error}"
        sender = (message.get_srcSystem(), message.get_srcComponent())
        ack = mavlink.MAVLink_command_ack_message(_DO_SET_SERVO, result, 0, 0, *sender)
        return self._maker.make(ack, Sender(system_id, mavlink.MAV_COMP_ID_AUTOPILOT1))
