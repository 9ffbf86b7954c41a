"""The state of a flight controller, and its MAVLink messages. Pure."""

from __future__ import annotations

from math import cos, radians, sin
from typing import Any, Final

from onboard_agent.autopilot.msp.answers import Altitude, Analog, Attitude, Gps, Status
from onboard_agent.autopilot.msp.boxes import Boxes
from wire.autopilots.msp_multicopter import MSP
from wire.dialect import mavlink

MIN_FIX_SATELLITES: Final = 5
"""Controllers with one bit for the fix set it from here on."""
_ACCELEROMETER, _BAROMETER, _COMPASS, _GPS = 1, 2, 4, 8
_SENSORS: Final = {
    _ACCELEROMETER: mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL | mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO,
    _BAROMETER: mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE,
    _COMPASS: mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG,
    _GPS: mavlink.MAV_SYS_STATUS_SENSOR_GPS,
}
_U16: Final = 0xFFFF


class MspVehicle:
    """What has been answered. None: not yet."""

    def __init__(self) -> None:
        self.boxes = Boxes()
        self.status: Status | None = None
        self.attitude: Attitude | None = None
        self.altitude: Altitude | None = None
        self.gps: Gps | None = None
        self.analog: Analog | None = None
        self.channels: tuple[int, ...] = ()
        """Roll, pitch, yaw, throttle, auxiliary channels."""
        self.variant = ""
        self.version = (0, 0, 0)
        self._home: tuple[int, int, int] | None = None

    @property
    def armed(self) -> bool:
        return self.status is not None and self.boxes.armed(self.status.flags)

    @property
    def mode(self) -> int:
        return self.boxes.mode(self.status.flags) if self.status is not None else 0

    @property
    def has_position(self) -> bool:
        return self.gps is not None and self.gps.fix > 0 and self.gps.satellites >= MIN_FIX_SATELLITES

    def took_gps(self) -> None:
        """Home is where it stood last before it was armed."""
        if self.gps is not None and self.has_position and (self._home is None or not self.armed):
            self._home = self.gps.lat_e7, self.gps.lon_e7, self.gps.altitude_m * 1000

    # Messages

    def heartbeat(self) -> Any:
        base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
        base |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0
        state = mavlink.MAV_STATE_ACTIVE if self.armed else mavlink.MAV_STATE_STANDBY
        return mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_QUADROTOR, MSP.autopilot, base, self.mode, state, 3)

    def system_status(self) -> Any:
        sensors = self.status.sensors if self.status is not None else 0
        bits = sum(int(bit) for sensor, bit in _SENSORS.items() if sensors & sensor)
        analog = self.analog
        millivolts = _U16 if analog is None else min(round(analog.voltage_v * 1000), _U16 - 1)
        centiamperes = -1 if analog is None else max(-1, min(round(analog.current_a * 100), 32767))
        return mavlink.MAVLink_sys_status_message(bits, bits, bits, 0, millivolts, centiamperes, -1, 0, 0, 0, 0, 0, 0)

    def landed_state(self) -> Any:
        """It does not tell whether it flies; disarmed it stands."""
        landed = mavlink.MAV_LANDED_STATE_UNDEFINED if self.armed else mavlink.MAV_LANDED_STATE_ON_GROUND
        return mavlink.MAVLink_extended_sys_state_message(mavlink.MAV_VTOL_STATE_UNDEFINED, landed)

    def attitude_message(self, boot_ms: int) -> Any | None:
        now = self.attitude
        if now is None:
            return None
        yaw = radians(now.yaw_deg if now.yaw_deg <= 180 else now.yaw_deg - 360)
        return mavlink.MAVLink_attitude_message(boot_ms, radians(now.roll_deg), radians(now.pitch_deg), yaw, 0, 0, 0)

    def position(self, boot_ms: int) -> Any | None:
        """Without a position nothing: a vehicle at 0, 0 would be shown off Africa."""
        gps = self.gps
        if gps is None or not self.has_position:
            return None
        altitude = self.altitude or Altitude(0.0, 0.0)
        course = radians(gps.course_ddeg / 10)
        heading = _U16 if self.attitude is None else round(self.attitude.yaw_deg * 100) % 36_000
        return mavlink.MAVLink_global_position_int_message(
            boot_ms,
            gps.lat_e7,
            gps.lon_e7,
            gps.altitude_m * 1000,
            round(altitude.height_m * 1000),
            _i16(gps.speed_cm_s * cos(course)),
            _i16(gps.speed_cm_s * sin(course)),
            _i16(-altitude.climb_m_s * 100),
            heading,
        )

    def gps_message(self, now_us: int) -> Any | None:
        gps = self.gps
        if gps is None:
            return None
        fix = mavlink.GPS_FIX_TYPE_3D_FIX if self.has_position else mavlink.GPS_FIX_TYPE_NO_FIX
        course = gps.course_ddeg * 10
        return mavlink.MAVLink_gps_raw_int_message(
            now_us,
            fix,
            gps.lat_e7,
            gps.lon_e7,
            gps.altitude_m * 1000,
            _U16,
            _U16,
            gps.speed_cm_s,
            course,
            gps.satellites,
        )

    def air(self) -> Any | None:
        if self.attitude is None or self.altitude is None:
            return None
        speed = self.gps.speed_cm_s / 100 if self.gps is not None else 0.0
        throttle = max(0, min(100, round((self.channels[3] - 1000) / 10))) if len(self.channels) > 3 else 0
        above_sea = float(self.gps.altitude_m) if self.gps is not None and self.has_position else self.altitude.height_m
        return mavlink.MAVLink_vfr_hud_message(
            0.0, speed, round(self.attitude.yaw_deg) % 360, throttle, above_sea, self.altitude.climb_m_s
        )

    def rc_channels(self, boot_ms: int) -> Any | None:
        """In the order of MAVLink: roll, pitch, throttle, yaw, the rest."""
        if len(self.channels) < 4:
            return None
        roll, pitch, yaw, throttle, *rest = self.channels
        pulses = [roll, pitch, throttle, yaw, *rest][:18]
        rssi = 255 if self.analog is None else min(254, self.analog.rssi * 254 // 1023)
        padded = pulses + [_U16] * (18 - len(pulses))
        return mavlink.MAVLink_rc_channels_message(boot_ms, len(pulses), *padded, rssi)

    def home(self) -> Any | None:
        if self._home is None:
            return None
        return mavlink.MAVLink_home_position_message(*self._home, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)

    def firmware(self) -> Any:
        major, minor, patch = self.version
        number = major << 24 | minor << 16 | patch << 8 | mavlink.FIRMWARE_VERSION_TYPE_OFFICIAL
        return mavlink.MAVLink_autopilot_version_message(0, number, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0)


def _i16(value: float) -> int:
    return max(-32768, min(round(value), 32767))
