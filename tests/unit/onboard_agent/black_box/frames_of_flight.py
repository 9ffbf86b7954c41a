"""Frames of a flight for the tests of the black box."""

from wire.dialect import build, mavlink


def attitude(number: int, *, roll_rad: float = 0.1) -> bytes:
    message = mavlink.MAVLink_attitude_message(number * 10, roll_rad, 0.2, 0.3, 0.4, 0.5, 0.6)
    return build(message, system_id=1, component_id=1, sequence=number)


def heartbeat(*, armed: bool = True) -> bytes:
    base_mode = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0)
    message = mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, base_mode, 5, 4, 3
    )
    return build(message, system_id=1, component_id=1, sequence=0)


def position() -> bytes:
    message = mavlink.MAVLink_global_position_int_message(5, 520000000, 130000000, 150000, 20000, 100, -200, 30, 9000)
    return build(message, system_id=1, component_id=1, sequence=0)


def battery() -> bytes:
    message = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 15800, 1230, 71, 0, 0, 0, 0, 0, 0)
    return build(message, system_id=1, component_id=1, sequence=0)


def sticks() -> bytes:
    message = mavlink.MAVLink_manual_control_message(1, 100, -200, 500, 7, 0)
    return build(message, system_id=255, component_id=190, sequence=0)


def signing() -> bytes:
    message = mavlink.MAVLink_setup_signing_message(1, 1, b"k" * 32, 1)
    return build(message, system_id=255, component_id=190, sequence=0)
