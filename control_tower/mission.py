"""Builds missions: rows of MISSION_ITEM_INT as the REST API takes them (docs/api.md), heights above home."""

from __future__ import annotations

from typing import Any, Final, Self

TAKE_OFF: Final = 22
WAY_POINT: Final = 16
LOITER_TIME: Final = 19
RETURN: Final = 20
LAND: Final = 21
SPEED: Final = 178
SERVO: Final = 183
_ABOVE_HOME: Final = 3
_MISSION: Final = 2
"""MAV_FRAME_MISSION: of items without a place."""


class Mission:
    """`Mission().take_off(20).way_point(47.39, 8.54, 30).return_home().rows`"""

    def __init__(self) -> None:
        self.rows: list[list[Any]] = []
        """`[command, frame, [param1, param2, param3, param4], x, y, z, autocontinue]`."""

    def take_off(self, height_m: float) -> Self:
        return self._placed(TAKE_OFF, 0.0, 0.0, height_m, [0, 0, 0, None])

    def way_point(self, lat_deg: float, lon_deg: float, height_m: float, *, wait_s: float = 0.0) -> Self:
        """Flies there, and waits there."""
        return self._placed(WAY_POINT, lat_deg, lon_deg, height_m, [wait_s, 0, 0, None])

    def speed(self, m_s: float) -> Self:
        """Over ground, from here on."""
        return self._done(SPEED, [1, m_s, -1, 0])

    def servo(self, channel: int, pulse_us: int) -> Self:
        """Sets a servo output of the autopilot, for a gripper or a release. `pulse_us`: 500 to 2500."""
        if not 500 <= pulse_us <= 2500:
            raise ValueError("a pulse has 500 to 2500 microseconds")
        return self._done(SERVO, [channel, pulse_us, 0, 0])

    def land(self, lat_deg: float, lon_deg: float) -> Self:
        return self._placed(LAND, lat_deg, lon_deg, 0.0, [0, 0, 0, None])

    def return_home(self) -> Self:
        return self._done(RETURN, [0, 0, 0, 0])

    def _placed(self, command: int, lat_deg: float, lon_deg: float, height_m: float, parameters: list[Any]) -> Self:
        x, y = round(lat_deg * 1e7), round(lon_deg * 1e7)
        self.rows.append([command, _ABOVE_HOME, parameters, x, y, height_m, 1])
        return self

    def _done(self, command: int, parameters: list[Any]) -> Self:
        self.rows.append([command, _MISSION, parameters, 0, 0, 0, 1])
        return self
