"""Messages that PX4 sends differently from ArduCopter, and the rates of its unrequested messages."""

from __future__ import annotations

from simulator.dialect import Message, mavlink
from simulator.flight import Flight
from simulator.px4.failsafe import Px4Failsafes
from simulator.px4.modes import STICK_MODES
from simulator.reports_common import us
from simulator.reports_health import HEALTH_REPORTS, sensors, state_of
from simulator.reports_motion import MOTION_REPORTS

VERSION = (1 << 24) | (15 << 16) | (4 << 8) | 255
CAPABILITIES = (
    mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_FTP
    | mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
    | mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
)
_NOT_PX4 = (152, 168, 193)
"""MEMINFO, WIND, EKF_STATUS_REPORT are ArduPilot's own."""

INTERVALS_S: dict[int, float] = {
    0: 1.0,
    1: 1.0,
    24: 1.0,
    30: 1 / 15,
    32: 1.0,
    33: 0.2,
    42: 1.0,
    65: 0.2,
    74: 0.25,
    147: 2.0,
    230: 2.0,
    241: 2.0,
    242: 2.0,
    245: 1.0,
}
"""Seconds between two of a message, on a radio link in PX4's normal mode."""


def heartbeat(flight: Flight) -> Message:
    base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
    if flight.mode in STICK_MODES:
        base |= mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
    elif flight.rules(flight.mode).counts_as_guided:
        base |= mavlink.MAV_MODE_FLAG_AUTO_ENABLED | mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
    state = mavlink.MAV_STATE_STANDBY
    if flight.armed:
        base |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED
        own = flight.failsafes
        failing = isinstance(own, Px4Failsafes) and own.has_chosen
        state = mavlink.MAV_STATE_CRITICAL if failing else mavlink.MAV_STATE_ACTIVE
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, base, int(flight.mode), state_of(flight, state), 3
    )


def sys_status(flight: Flight) -> Message:
    """A receiver is present while valid sticks arrive, whoever sends them; it is never reported unhealthy."""
    heard = flight.sticks.silent_for_s(flight.now_s) <= 0.0
    ready = flight.why_not_ready() is None
    return sensors(flight, with_prearm=ready, with_receiver=heard, receiver_healthy=True, enables_prearm=False)


def rc_channels(flight: Flight) -> Message | None:
    """Sent only while a receiver, or RC_CHANNELS_OVERRIDE in its place, is active."""
    return HEALTH_REPORTS[65](flight) if flight.sticks.channel_count else None


def autopilot_version(_flight: Flight) -> Message:
    return mavlink.MAVLink_autopilot_version_message(
        CAPABILITIES, VERSION, 0, 0, 0, list(b"simulate"), [0] * 8, [0] * 8, 0, 0, 0
    )


def estimator_status(flight: Flight) -> Message:
    flags = 0
    if flight.estimator.attitude_ok:
        flags |= mavlink.ESTIMATOR_ATTITUDE | mavlink.ESTIMATOR_VELOCITY_VERT | mavlink.ESTIMATOR_POS_VERT_ABS
    if flight.estimator.position_ok:
        flags |= mavlink.ESTIMATOR_VELOCITY_HORIZ | mavlink.ESTIMATOR_POS_HORIZ_REL | mavlink.ESTIMATOR_POS_HORIZ_ABS
    ratio = 0.05 if flight.estimator.position_ok else 1.2
    return mavlink.MAVLink_estimator_status_message(us(flight), flags, ratio, ratio, 0.05, 0.05, 0.0, 0.0, 0.5, 0.8)


REPORTS = {
    **{number: report for number, report in HEALTH_REPORTS.items() if number not in _NOT_PX4},
    **{number: report for number, report in MOTION_REPORTS.items() if number not in _NOT_PX4},
    0: heartbeat,
    1: sys_status,
    65: rc_channels,
    148: autopilot_version,
    230: estimator_status,
}
