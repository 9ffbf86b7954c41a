"""Motion of the drone as the autopilot reports it: tilt, height, climb, and whether it has a position. No I/O."""

from math import cos, hypot, radians
from typing import Any, Final

from wire.dialect import mavlink
from wire.places import place_of

LEVEL_WITHIN_DEG: Final = 12.0
"""Within this tilt a mode that brakes may take over. Full tilt is 30 to 45 degrees."""

FRESH_S: Final = 1.5
ESTIMATE_FRESH_S: Final = 3.0
"""The estimator reports once a second."""

NEAR_GROUND_M: Final = 8.0
"""Stage one stops a full descent within 2.3 to 3.8 m (docs/control.md); home may be lower than the ground here."""
SINKING_M_S: Final = 0.7
"""Faster than a landing's last metres (0.5 m/s)."""

_ESTIMATES: Final = frozenset({mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT, mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS})

READ: Final = _ESTIMATES | {
    mavlink.MAVLINK_MSG_ID_ATTITUDE,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS,
}
"""Messages of the autopilot to pass to `read`."""

_POSITION: Final = mavlink.EKF_POS_HORIZ_ABS
_NO_POSITION: Final = mavlink.EKF_CONST_POS_MODE
_DEG_PER_RAD: Final = 57.29578
_M_PER_DEG: Final = 111_320.0
_UNKNOWN_PERCENT: Final = (-1, 255)


class Motion:
    """Feed it decoded messages of the autopilot."""

    def __init__(self) -> None:
        self.alt_rel_m = 0.0
        """Height above home."""
        self.climb_m_s = 0.0
        self.speed_m_s = 0.0
        """Speed over ground."""
        self.battery_percent: float | None = None
        self._tilt_deg = 0.0
        self._tilt_at = float("-inf")
        self._moved_at = float("-inf")
        self._flags = 0
        self._flags_at = float("-inf")
        self._here: tuple[float, float] | None = None
        self._home: tuple[float, float] | None = None

    def read(self, message_id: int, message: Any, now: float) -> None:
        """Handles a message of READ from the autopilot."""
        if message_id == mavlink.MAVLINK_MSG_ID_ATTITUDE:
            self.attitude(message, now)
        elif message_id == mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT:
            self.global_position(message, now)
        elif message_id in _ESTIMATES:
            self.estimator(message, now)
        elif message_id == mavlink.MAVLINK_MSG_ID_HOME_POSITION:
            self.home_position(message)
        elif message_id == mavlink.MAVLINK_MSG_ID_SYS_STATUS:
            self.battery(message)

    def attitude(self, message: Any, now: float) -> None:
        """ATTITUDE."""
        self._tilt_deg = max(abs(message.roll), abs(message.pitch)) * _DEG_PER_RAD
        self._tilt_at = now

    def global_position(self, message: Any, now: float) -> None:
        """GLOBAL_POSITION_INT."""
        self.alt_rel_m = message.relative_alt / 1000.0
        self.climb_m_s = -message.vz / 100.0
        self.speed_m_s = hypot(message.vx, message.vy) / 100.0
        self._here = place_of(message.lat, message.lon)
        self._moved_at = now

    def estimator(self, message: Any, now: float) -> None:
        """EKF_STATUS_REPORT of ArduPilot, ESTIMATOR_STATUS of PX4: the same bits."""
        self._flags = message.flags
        self._flags_at = now

    def home_position(self, message: Any) -> None:
        """HOME_POSITION."""
        self._home = place_of(message.latitude, message.longitude)

    def battery(self, message: Any) -> None:
        """SYS_STATUS."""
        percent = message.battery_remaining
        self.battery_percent = None if percent in _UNKNOWN_PERCENT else float(percent)

    def level(self, now: float) -> bool | None:
        """Whether the drone is nearly level; None without a fresh report."""
        return self._tilt_deg <= LEVEL_WITHIN_DEG if now - self._tilt_at <= FRESH_S else None

    def has_position(self, now: float) -> bool | None:
        """Whether the estimator has a position; None if it does not report."""
        if now - self._flags_at > ESTIMATE_FRESH_S:
            return None
        return bool(self._flags & _POSITION) and not self._flags & _NO_POSITION

    def sinking(self, now: float) -> bool:
        """Whether the drone descends faster than in a landing."""
        return now - self._moved_at <= FRESH_S and self.climb_m_s < -SINKING_M_S

    def low_and_sinking(self, now: float) -> bool:
        """Whether the drone would touch the ground before a level hold stops its descent."""
        return self.alt_rel_m < NEAR_GROUND_M and self.sinking(now)

    @property
    def home_m(self) -> float | None:
        """Distance over ground to home in metres; None unless both positions are known."""
        if self._here is None or self._home is None:
            return None
        north = (self._home[0] - self._here[0]) * _M_PER_DEG
        east = (self._home[1] - self._here[1]) * _M_PER_DEG * cos(radians(self._here[0]))
        return hypot(north, east)
