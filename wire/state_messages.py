"""Separates state messages, of which only the newest counts, from transactional ones, which must all arrive.

A message not listed as state counts as transactional: unknown messages are never dropped silently. Both ends of the
uplink use this: the agent to thin a stream, the tower to spare slow browsers.
"""

from typing import Final

from wire.dialect import mavlink
from wire.frames import MAGIC_V2, payload

_STATE_NAMES: Final = (
    "HEARTBEAT SYS_STATUS SYSTEM_TIME GPS_RAW_INT GPS2_RAW GPS_STATUS GPS_RTK GPS2_RTK RAW_IMU SCALED_IMU SCALED_IMU2 "
    "SCALED_IMU3 RAW_PRESSURE SCALED_PRESSURE SCALED_PRESSURE2 SCALED_PRESSURE3 ATTITUDE ATTITUDE_QUATERNION "
    "LOCAL_POSITION_NED LOCAL_POSITION_NED_COV GLOBAL_POSITION_INT GLOBAL_POSITION_INT_COV RC_CHANNELS "
    "RC_CHANNELS_SCALED RC_CHANNELS_RAW SERVO_OUTPUT_RAW NAV_CONTROLLER_OUTPUT MISSION_CURRENT VFR_HUD "
    "POSITION_TARGET_LOCAL_NED POSITION_TARGET_GLOBAL_INT ATTITUDE_TARGET HIGHRES_IMU OPTICAL_FLOW RADIO_STATUS "
    "BATTERY_STATUS TERRAIN_REPORT ALTITUDE EKF_STATUS_REPORT ESTIMATOR_STATUS VIBRATION HOME_POSITION "
    "EXTENDED_SYS_STATE ADSB_VEHICLE WIND WIND_COV MEMINFO HWSTATUS POWER_STATUS MCU_STATUS AHRS AHRS2 AHRS3 SIMSTATE "
    "SIM_STATE DISTANCE_SENSOR RANGEFINDER RPM ESC_TELEMETRY_1_TO_4 ESC_TELEMETRY_5_TO_8 FENCE_STATUS "
    "ODOMETRY WHEEL_DISTANCE BATTERY2 MOUNT_STATUS GIMBAL_DEVICE_ATTITUDE_STATUS GIMBAL_MANAGER_STATUS SENSOR_OFFSETS "
    "LOCAL_POSITION_NED_SYSTEM_GLOBAL_OFFSET AOA_SSA DEEPSTALL PID_TUNING WINCH_STATUS GENERATOR_STATUS EFI_STATUS "
    "HIGH_LATENCY HIGH_LATENCY2 ATTITUDE_QUATERNION_COV CONTROL_SYSTEM_STATE ACTUATOR_OUTPUT_STATUS MOUNT_ORIENTATION "
    "HYGROMETER_SENSOR WATER_DEPTH ESC_TELEMETRY_9_TO_12 ESC_TELEMETRY_13_TO_16 ESC_TELEMETRY_17_TO_20 "
    "ORBIT_EXECUTION_STATUS VISION_POSITION_ESTIMATE VISION_SPEED_ESTIMATE CAMERA_FOV_STATUS "
    "CAMERA_TRACKING_GEO_STATUS CAMERA_TRACKING_IMAGE_STATUS ISBD_LINK_STATUS MANUAL_SETPOINT"
)

_WITHOUT_INSTANCE: Final = (0, 0)

_INSTANCES: Final[dict[int, tuple[int, int]]] = {
    msgid: (cls.instance_offset, 1) if getattr(cls, "instance_field", None) else _WITHOUT_INSTANCE
    for msgid, cls in mavlink.mavlink_map.items()
    if cls.msgname in _STATE_NAMES.split()
} | {
    mavlink.MAVLINK_MSG_ID_ADSB_VEHICLE: (0, 4),  # the aircraft's address
    mavlink.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT: (8, 10),  # scripts send dozens of these, told apart by name
    mavlink.MAVLINK_MSG_ID_NAMED_VALUE_INT: (8, 10),
    mavlink.MAVLINK_MSG_ID_DEBUG_VECT: (20, 10),
    mavlink.MAVLINK_MSG_ID_DEBUG: (8, 1),
    mavlink.MAVLINK_MSG_ID_ACTUATOR_CONTROL_TARGET: (40, 1),
    mavlink.MAVLINK_MSG_ID_RAW_RPM: (4, 1),
    mavlink.MAVLINK_MSG_ID_OBSTACLE_DISTANCE: (156, 1),  # by the kind of sensor
}
"""Message id of a state message to the position of its instance in the payload: (offset, bytes)."""

StateKey = tuple[int, int, int, int]
"""(sysid, compid, message id, instance): a newer frame replaces an older one with the same key."""


_KNOWN: Final[dict[bytes, StateKey | None]] = {}
"""Sender and message id of version 2, as in a frame, to the key; for messages without an instance."""

_MAX_KNOWN: Final = 4096
_UNKNOWN: Final[StateKey] = (-1, -1, -1, -1)


def state_key(frame: bytes) -> StateKey | None:
    """Returns the key of the state that a whole frame carries, or None if it is transactional.

    The instance distinguishes, for example, two batteries of one sender; it is 0 if the message has none.
    """
    # Runs once for every frame: for nearly all of them the five header bytes with sender and message id suffice.
    if frame[0] == MAGIC_V2:
        head = frame[5:10]
        known = _KNOWN.get(head, _UNKNOWN)
        if known is not _UNKNOWN:
            return known
        sysid, compid, msgid = frame[5], frame[6], frame[7] | frame[8] << 8 | frame[9] << 16
    else:
        head = b""
        sysid, compid, msgid = frame[3], frame[4], frame[5]
    place = _INSTANCES.get(msgid)
    if place is not None and place is not _WITHOUT_INSTANCE:
        offset, width = place
        # Version 2 truncates trailing zeros, so a missing byte is a zero.
        return (sysid, compid, msgid, int.from_bytes(payload(frame)[offset : offset + width], "little"))
    key = None if place is None else (sysid, compid, msgid, 0)
    if head:
        if len(_KNOWN) >= _MAX_KNOWN:  # fills only with ids that do not exist; real ones are soon known again
            _KNOWN.clear()
        _KNOWN[head] = key
    return key
