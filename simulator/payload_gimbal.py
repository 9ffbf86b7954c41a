"""A two-axis gimbal, and its manager in the autopilot: its direction, and who may turn it."""

from __future__ import annotations

import math

from simulator.command_message import ACCEPTED, DENIED, UNSUPPORTED, Command
from simulator.dialect import Message, mavlink
from simulator.flight import Flight
from simulator.reports_common import ms

PITCH_MIN_DEG, PITCH_MAX_DEG, YAW_MAX_DEG = -90.0, 30.0, 180.0
RATE_DEG_S = 60.0
DEVICE = int(mavlink.MAV_COMP_ID_GIMBAL)
FLAGS = int(
    mavlink.GIMBAL_DEVICE_FLAGS_ROLL_LOCK
    | mavlink.GIMBAL_DEVICE_FLAGS_PITCH_LOCK
    | mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
)
CAPABILITIES = int(
    mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_PITCH_AXIS
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_PITCH_LOCK
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_AXIS
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_FOLLOW
)
"""As device and as manager: both use the same numbers."""
MANAGER_INFORMATION = int(mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION)
MANAGER_STATUS = int(mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS)
_ATTITUDE = int(mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS)
_LIMITS = (0.0, 0.0, *(math.radians(deg) for deg in (PITCH_MIN_DEG, PITCH_MAX_DEG, -YAW_MAX_DEG, YAW_MAX_DEG)))
"""Minimum and maximum of roll, pitch, yaw, in radians."""
_KEEP, _MYSELF, _NOBODY = -1, -2, -3
"""Ids in DO_GIMBAL_MANAGER_CONFIGURE; 0 also means nobody."""


class Gimbal:
    heartbeat_type = int(mavlink.MAV_TYPE_GIMBAL)
    intervals_s = {_ATTITUDE: 0.2}  # noqa: RUF012 - of the protocol; nobody writes it

    def __init__(self) -> None:
        self.pitch_deg = self.yaw_deg = 0.0
        """Pitch relative to the horizon, yaw relative to the nose."""
        self._wanted = (0.0, 0.0)
        self._yaw_locked = False
        """The wanted yaw is from north."""
        self._primary = (0, 0)
        """The component in control: system and component id."""
        self._ticked_s: float | None = None

    # The device.

    def report(self, message_id: int, flight: Flight) -> Message | None:
        if message_id == _ATTITUDE:
            return mavlink.MAVLink_gimbal_device_attitude_status_message(
                0, 0, ms(flight), FLAGS, self._quaternion(), 0.0, 0.0, 0.0, 0
            )
        if message_id == mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_INFORMATION:
            names = (b"tower-sim", b"simulated gimbal", b"")
            return mavlink.MAVLink_gimbal_device_information_message(
                ms(flight), *names, 1, 1, 0, CAPABILITIES, 0, *_LIMITS
            )
        return None

    def carry_out(self, flight: Flight, command: Command) -> int:
        """The manager turns it."""
        del flight, command
        return UNSUPPORTED

    def tick(self, flight: Flight) -> None:
        last_s, self._ticked_s = self._ticked_s, flight.now_s
        if last_s is None:
            return
        most_deg = RATE_DEG_S * max(flight.now_s - last_s, 0.0)
        pitch, yaw = self._wanted
        if self._yaw_locked:
            yaw = (yaw - math.degrees(flight.body.attitude()[2]) + 180.0) % 360.0 - 180.0
        self.pitch_deg += min(max(pitch - self.pitch_deg, -most_deg), most_deg)
        self.yaw_deg += min(max(yaw - self.yaw_deg, -most_deg), most_deg)

    def _quaternion(self) -> list[float]:
        """Returns the attitude with no roll, pitch relative to the horizon and yaw relative to the nose."""
        half_pitch, half_yaw = math.radians(self.pitch_deg) / 2.0, math.radians(self.yaw_deg) / 2.0
        cos_p, sin_p, cos_y, sin_y = math.cos(half_pitch), math.sin(half_pitch), math.cos(half_yaw), math.sin(half_yaw)
        return [cos_p * cos_y, -sin_p * sin_y, sin_p * cos_y, cos_p * sin_y]

    # The manager, which is the autopilot.

    def manager_report(self, message_id: int, flight: Flight) -> Message | None:
        if message_id == MANAGER_INFORMATION:
            return mavlink.MAVLink_gimbal_manager_information_message(ms(flight), CAPABILITIES, DEVICE, *_LIMITS)
        if message_id == MANAGER_STATUS:
            return mavlink.MAVLink_gimbal_manager_status_message(ms(flight), FLAGS, DEVICE, *self._primary, 0, 0)
        return None

    def manage(self, command: Command, sender: tuple[int, int]) -> int | None:
        """Returns None for a command that is not for the manager. Only the primary in control, which
        DO_GIMBAL_MANAGER_CONFIGURE sets, turns the gimbal."""
        if command.number == mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE:
            self._configure(command, sender)
            return ACCEPTED
        if command.number != mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW:
            return None
        if sender != self._primary:
            return DENIED
        pitch, yaw = command.params[0], command.params[1]
        flags = int(command.raw[4]) if command.is_long else 0
        self._yaw_locked = bool(flags & mavlink.GIMBAL_MANAGER_FLAGS_YAW_LOCK)
        self._wanted = (
            min(max(pitch, PITCH_MIN_DEG), PITCH_MAX_DEG),
            min(max(yaw, -YAW_MAX_DEG), YAW_MAX_DEG),
        )
        return ACCEPTED

    def _configure(self, command: Command, sender: tuple[int, int]) -> None:
        system, component = int(command.params[0]), int(command.params[1])
        if system == _MYSELF:
            self._primary = sender
        elif system in (0, _NOBODY):
            self._primary = (0, 0) if system == 0 or self._primary == sender else self._primary
        elif system != _KEEP:
            self._primary = (system & 0xFF, component & 0xFF)
