"""Writes what a log says of a flight as the telemetry that the autopilot would have sent: MAVLink frames with times.
Pure but for the file that it is given.

Logs have hundreds of messages a second. Each kind is written at most as often as a fast link would bring it
(`EVERY_US`); a heartbeat comes every second, and at once when mode or arming change.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import IO, Any, Final

from server.flights.core.imports.refusals import BadFlightFile
from server.flights.core.tlog import STAMP, Entry
from server.flights.core.track import FlightSummary
from wire.dialect import mavlink

MAX_FLIGHT_US: Final = 24 * 3600 * 1_000_000
MAX_PAUSE_US: Final = 60 * 1_000_000
"""A message later by more than this is left out unless the next one agrees: a damaged time would end the flight."""
_HEARTBEAT_US: Final = 1_000_000
_MAX_US: Final = 4_102_444_800_000_000
"""The year 2100."""
EVERY_US: Final = {
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 40_000,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 100_000,
    mavlink.MAVLINK_MSG_ID_VFR_HUD: 200_000,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: 200_000,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: 500_000,
    mavlink.MAVLINK_MSG_ID_RC_CHANNELS: 100_000,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 100_000,
    mavlink.MAVLINK_MSG_ID_VIBRATION: 200_000,
}
_SLACK_US: Final = 2_000
"""Logs have jitter: a message that comes a little early is not left out."""
TEXT_BYTES: Final = 50
MAX_TEXT_PARTS: Final = 5
_NO_CHANNEL: Final = 0xFFFF
_CHANNELS: Final = 18


@dataclass(frozen=True)
class Airframe:
    """What a heartbeat says: numbers of MAV_TYPE and MAV_AUTOPILOT."""

    vehicle_type: int
    autopilot: int


class TelemetryWriter:
    """`base_us`: what added to the log's times gives microseconds since 1970."""

    def __init__(self, out: IO[bytes], airframe: Airframe, *, base_us: int, max_bytes: int) -> None:
        self._out = out
        self._airframe = airframe
        self._base_us = base_us
        self._max_bytes = max_bytes
        self._link = mavlink.MAVLink(None, srcSystem=1, srcComponent=mavlink.MAV_COMP_ID_AUTOPILOT1)
        self._written_us: dict[int, int] = {}
        self.summary: FlightSummary | None = None
        self.began_us = self._now_us = self._ahead_us = -1
        self._armed = False
        self._mode = 0
        self._texts = 0
        self._size = 0

    def at(self, at_us: int) -> bool:
        """The time of what follows, by the log's clock. False: no time of this flight; leave it out."""
        if not 0 <= self._base_us + at_us < _MAX_US:
            return False
        if self.began_us < 0:
            self.began_us = self._now_us = at_us
            self.summary = FlightSummary(self._base_us + at_us)
        if not self.began_us <= at_us < self.began_us + MAX_FLIGHT_US:
            return False
        if at_us > self._now_us + MAX_PAUSE_US:
            ahead_us, self._ahead_us = at_us - self._ahead_us, at_us
            if not 0 <= ahead_us <= MAX_PAUSE_US:
                return False
        self._now_us = max(self._now_us, at_us)  # threads write to the log: a message may come a little late
        if self._is_due(mavlink.MAVLINK_MSG_ID_HEARTBEAT, _HEARTBEAT_US):
            self._heartbeat()
        return True

    def begin(self, *, custom_mode: int, is_armed: bool) -> None:
        """How the flight begins. Logs often begin at arming: what they say first may come a little after the rest."""
        self._mode, self._armed = custom_mode & 0xFFFF_FFFF, is_armed

    def mode(self, custom_mode: int) -> None:
        if custom_mode != self._mode:
            self._mode = custom_mode & 0xFFFF_FFFF
            self._heartbeat()

    def armed(self, is_armed: bool) -> None:
        if is_armed != self._armed:
            self._armed = is_armed
            self._heartbeat()

    def attitude(self, angles_rad: tuple[float, float, float], rates_rad_s: tuple[float, float, float]) -> None:
        """Roll, pitch and yaw."""
        if all(map(math.isfinite, (*angles_rad, *rates_rad_s))):
            yaw = math.remainder(angles_rad[2], math.tau)
            self._put(mavlink.MAVLink_attitude_message(self._boot_ms, *angles_rad[:2], yaw, *rates_rad_s))

    def position(
        self,
        lat_deg: float,
        lon_deg: float,
        *,
        msl_m: float,
        rel_m: float,
        ned_m_s: tuple[float, float, float],
        heading_deg: float | None,
    ) -> None:
        if not (math.isfinite(lat_deg + lon_deg) and abs(lat_deg) <= 90 and abs(lon_deg) <= 180):
            return
        place = round(lat_deg * 1e7), round(lon_deg * 1e7), whole(msl_m, 1000, 31), whole(rel_m, 1000, 31)
        course = 0xFFFF if heading_deg is None else round(heading_deg * 100) % 36_000
        speed = [whole(one, 100, 15) for one in ned_m_s]
        self._put(mavlink.MAVLink_global_position_int_message(self._boot_ms, *place, *speed, course))

    def flight_display(
        self, *, air_m_s: float, ground_m_s: float, heading_deg: float, throttle: float, msl_m: float, climb_m_s: float
    ) -> None:
        """`throttle`: 0 to 1."""
        if all(map(math.isfinite, (air_m_s, ground_m_s, heading_deg, throttle, msl_m, climb_m_s))):
            percent = min(max(round(throttle * 100), 0), 100)
            values = air_m_s, ground_m_s, round(heading_deg) % 360, percent, msl_m, climb_m_s
            self._put(mavlink.MAVLink_vfr_hud_message(*values))

    def gps(
        self,
        *,
        fix: int,
        lat_deg: float,
        lon_deg: float,
        msl_m: float,
        hdop: float,
        ground_m_s: float,
        course_deg: float,
        satellites: int,
    ) -> None:
        place = whole(lat_deg, 1e7, 31), whole(lon_deg, 1e7, 31), whole(msl_m, 1000, 31)
        course = round(course_deg * 100) % 36_000 if math.isfinite(course_deg) else 0xFFFF
        rest = whole(hdop, 100, 16), 0xFFFF, whole(ground_m_s, 100, 16), course, min(max(satellites, 0), 255)
        self._put(mavlink.MAVLink_gps_raw_int_message(self._now_us, min(max(fix, 0), 8), *place, *rest))

    def battery(self, *, volts: float, amperes: float | None, percent: float | None) -> None:
        current = -1 if amperes is None else whole(amperes, 100, 15)
        rest = -1 if percent is None or not math.isfinite(percent) else min(max(round(percent), 0), 100)
        self._put(mavlink.MAVLink_sys_status_message(0, 0, 0, 0, whole(volts, 1000, 16), current, rest, *[0] * 6))

    def receiver(self, channels: list[int], rssi: int = 255) -> None:
        """PWM in microseconds, from channel 1 on."""
        pulses = [min(max(one, 0), _NO_CHANNEL) for one in channels[:_CHANNELS]]
        filled = pulses + [_NO_CHANNEL] * (_CHANNELS - len(pulses))
        self._put(mavlink.MAVLink_rc_channels_message(self._boot_ms, len(pulses), *filled, rssi))

    def servos(self, pulses: list[int]) -> None:
        """PWM in microseconds, from output 1 on."""
        filled = ([min(max(one, 0), 0xFFFF) for one in pulses] + [0] * 16)[:16]
        boot_us = self._now_us & 0xFFFF_FFFF
        self._put(mavlink.MAVLink_servo_output_raw_message(boot_us, 0, *filled[:8], *filled[8:]))

    def vibration(self, m_s2: tuple[float, float, float], clips: tuple[int, int, int]) -> None:
        if all(map(math.isfinite, m_s2)):
            self._put(mavlink.MAVLink_vibration_message(self._now_us, *m_s2, *(one & 0xFFFF_FFFF for one in clips)))

    def home(self, lat_deg: float, lon_deg: float, msl_m: float) -> None:
        place = whole(lat_deg, 1e7, 31), whole(lon_deg, 1e7, 31), whole(msl_m, 1000, 31)
        self._put(mavlink.MAVLink_home_position_message(*place, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))

    def landed(self, is_landed: bool) -> None:
        state = mavlink.MAV_LANDED_STATE_ON_GROUND if is_landed else mavlink.MAV_LANDED_STATE_IN_AIR
        self._put(mavlink.MAVLink_extended_sys_state_message(0, state))

    def text(self, severity: int, text: str) -> None:
        """`severity`: of MAV_SEVERITY. Cut off after `MAX_TEXT_PARTS` messages."""
        content = text.encode("utf-8", "replace")[: TEXT_BYTES * MAX_TEXT_PARTS]
        parts = [content[at : at + TEXT_BYTES] for at in range(0, len(content), TEXT_BYTES)]
        is_long = len(content) > TEXT_BYTES
        self._texts = self._texts % 0xFFFF + 1
        for number, part in enumerate(parts):
            mark = (self._texts, number) if is_long else (0, 0)
            self._put(mavlink.MAVLink_statustext_message(severity, part, *mark))

    @property
    def _boot_ms(self) -> int:
        return self._now_us // 1000 & 0xFFFF_FFFF

    def _is_due(self, kind: int, every_us: int) -> bool:
        last_us = self._written_us.get(kind)
        return last_us is None or self._now_us - last_us >= every_us - _SLACK_US

    def _heartbeat(self) -> None:
        flags = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        status = mavlink.MAV_STATE_STANDBY
        if self._armed:
            flags, status = flags | mavlink.MAV_MODE_FLAG_SAFETY_ARMED, mavlink.MAV_STATE_ACTIVE
        kind = self._airframe.vehicle_type, self._airframe.autopilot
        self._put(mavlink.MAVLink_heartbeat_message(*kind, flags, self._mode, status, 3))

    def _put(self, message: Any) -> None:
        kind = message.get_msgId()
        if not self._is_due(kind, EVERY_US.get(kind, 0)):
            return
        self._written_us[kind] = self._now_us
        frame = bytes(message.pack(self._link))
        self._link.seq = self._link.seq + 1 & 0xFF
        at_us = self._base_us + self._now_us
        self._size += STAMP.size + len(frame)
        if self._size > self._max_bytes:
            raise BadFlightFile(TOO_LONG)
        self._out.write(STAMP.pack(at_us) + frame)
        assert self.summary is not None
        self.summary.take(Entry(at_us, frame, self._size))


TOO_LONG: Final = "the flight is too long to be replayed: it would become a telemetry log of more than 160 MiB"


def whole(value: float, scale: float, bits: int) -> int:
    """As a whole number within `bits` (15 and 31: signed, 16: unsigned); 0 for no number."""
    if not math.isfinite(value):
        return 0
    low, high = (0, 2**16 - 1) if bits == 16 else (-(2**bits), 2**bits - 1)
    return min(max(round(value * scale), low), high)
