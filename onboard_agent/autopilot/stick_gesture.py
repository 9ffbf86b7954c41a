"""Keeps arming and disarming by sticks from the autopilot. Pure; takes `now`.

Throttle down and yaw at its end, for one or two seconds, arms a drone and stops the motors of one in the air: ArduPilot
by ARMING_RUDDER, in modes with a manual throttle; PX4 by MAN_ARM_GESTURE and COM_DISARM_MAN. These are on by default,
and pass by what guards a command. So with the throttle down yaw ends at 85 %, where neither sees the gesture.
"""

import struct
from typing import Final

from wire.dialect import mavlink
from wire.frame_signing import with_payload
from wire.frames import message_id, payload

TOLD_AFTER_S: Final = 0.8
"""A hand that only passes the corner is not told of it."""
TOLD: Final = "Sticks do not arm or disarm: with the throttle down, yaw ends at 85 %. Use the command."

_MANUAL: Final = struct.Struct("<hhhh")
_LOW: Final = 200
"""Of 1000. By its sources PX4 looks for the gesture below 100, with yaw beyond 90 %, for a second."""
_YAW_END: Final = 850
_OVERRIDE: Final = struct.Struct("<8H")
_LOW_US: Final = 1200
_CENTRE_US: Final = 1500
_YAW_END_US: Final = 340
"""85 % of a channel that ends at 1100 and 1900."""
_UNTOUCHED: Final = (0, 65535)


def without_gesture(frame: bytes) -> bytes:
    """Returns a frame with sticks, with less yaw where it would be such a gesture; any other frame as it is."""
    kind = message_id(frame)
    if kind == mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL:
        body = payload(frame).ljust(_MANUAL.size, b"\0")
        pitch, roll, throttle, yaw = _MANUAL.unpack_from(body)
        if throttle > _LOW or abs(yaw) <= _YAW_END:
            return frame
        limited = _YAW_END if yaw > 0 else -_YAW_END
        return with_payload(frame, _MANUAL.pack(pitch, roll, throttle, limited) + body[_MANUAL.size :])
    if kind == mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE:
        body = payload(frame).ljust(_OVERRIDE.size, b"\0")
        channels = list(_OVERRIDE.unpack_from(body))
        throttle, yaw = channels[2], channels[3]
        is_up = throttle not in _UNTOUCHED and throttle > _LOW_US  # else the transmitter's throttle may be down
        if is_up or yaw in _UNTOUCHED or abs(yaw - _CENTRE_US) <= _YAW_END_US:
            return frame
        channels[3] = _CENTRE_US + (_YAW_END_US if yaw > _CENTRE_US else -_YAW_END_US)
        return with_payload(frame, _OVERRIDE.pack(*channels) + body[_OVERRIDE.size :])
    return frame


class GestureGuard:
    """Of one drone, for all sticks that come through the tower."""

    def __init__(self) -> None:
        self._since: float | None = None
        self._told = False
        self.held_back = 0
        """Gestures, not frames."""

    def pass_on(self, frame: bytes, now: float) -> tuple[bytes, str | None]:
        """Returns the frame for the autopilot, and words for the pilot if there is something to say."""
        passed = without_gesture(frame)
        if passed is frame:
            self._since, self._told = None, False
            return frame, None
        self._since = now if self._since is None else self._since
        if self._told or now - self._since < TOLD_AFTER_S:
            return passed, None
        self._told = True
        self.held_back += 1
        return passed, TOLD
