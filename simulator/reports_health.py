"""Telemetry about the vehicle's state: heartbeat, sensors, battery, estimate, home, radio."""

from __future__ import annotations

from collections.abc import Callable

from simulator.auto import Auto
from simulator.dialect import Message, mavlink
from simulator.failure_modes import Failure
from simulator.firmware.states import SystemState
from simulator.flight import Flight
from simulator.geodesy import e7
from simulator.reports_common import int16, milli, ms, us

BOOT_UNIX_US = 1_767_225_600_000_000
"""The GPS clock at power-on, always the same, so that runs are repeatable byte for byte."""

OFFICIAL = 255
"""4.6.2, official release."""

CAPABILITIES = (
    mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
    | mavlink.MAV_PROTOCOL_CAPABILITY_FTP
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
    | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    | mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
    | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
    | mavlink.MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
)

_SENSORS = (
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | mavlink.MAV_SYS_STATUS_SENSOR_GPS
    | mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
    | mavlink.MAV_SYS_STATUS_AHRS
    | mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
    | mavlink.MAV_SYS_STATUS_PREARM_CHECK
)


_CONCERNED = {
    "GPS lost": mavlink.MAV_SYS_STATUS_SENSOR_GPS,
    "GPS glitch": mavlink.MAV_SYS_STATUS_SENSOR_GPS,
    "Compass inconsistent": mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG,
    "Heading doubtful": mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG,
    "Barometer stuck": mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE,
    "Vibration high": mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL,
    "Battery voltage low": mavlink.MAV_SYS_STATUS_SENSOR_BATTERY,
    "Battery empty": mavlink.MAV_SYS_STATUS_SENSOR_BATTERY,
    "Motor failure": mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS,
    "Position unknown": mavlink.MAV_SYS_STATUS_AHRS,
    "Attitude unknown": mavlink.MAV_SYS_STATUS_AHRS,
    "Radio lost": mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER,
}
"""What is unhealthy in SYS_STATUS, by the commander's fault. The others concern no part of the vehicle."""

_STATES = {
    SystemState.INIT: mavlink.MAV_STATE_BOOT,
    SystemState.STARTUP: mavlink.MAV_STATE_BOOT,
    SystemState.SAFE: mavlink.MAV_STATE_STANDBY,
    SystemState.RUN_AUTO: mavlink.MAV_STATE_ACTIVE,
    SystemState.RUN_MANUAL: mavlink.MAV_STATE_ACTIVE,
    SystemState.FAIL_MINOR: mavlink.MAV_STATE_CRITICAL,
    SystemState.FAIL_MAJOR: mavlink.MAV_STATE_EMERGENCY,
}


def state_of(flight: Flight, without_commander: int) -> int:
    """The state in HEARTBEAT. A commander decides it, where there is one."""
    return without_commander if flight.commander is None else int(_STATES[flight.commander.state])


def heartbeat(flight: Flight) -> Message:
    base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
    base |= mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
    if flight.rules(flight.mode).counts_as_guided:
        base |= mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
    if flight.armed:
        base |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    if flight.failsafes.any:
        state = mavlink.MAV_STATE_CRITICAL
    else:
        state = mavlink.MAV_STATE_STANDBY if flight.landed else mavlink.MAV_STATE_ACTIVE
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_QUADROTOR,
        mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
        base,
        int(flight.mode),
        state_of(flight, state),
        3,
    )


def sys_status(flight: Flight) -> Message:
    """Sticks of a ground station count as a receiver permanently; it is healthy except in the radio failsafe."""
    ready = flight.armed or flight.why_not_ready() is None
    heard = flight.sticks.ever_heard
    healthy = heard and not flight.failsafes.radio
    return sensors(flight, with_prearm=ready, with_receiver=heard, receiver_healthy=healthy)


def sensors(
    flight: Flight, *, with_prearm: bool, with_receiver: bool, receiver_healthy: bool, enables_prearm: bool = True
) -> Message:
    """SYS_STATUS. Each autopilot defines the receiver's presence differently."""
    battery, present = flight.battery, _SENSORS
    if with_receiver:
        present |= mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
    if not flight.fence.limits(flight).none:
        present |= mavlink.MAV_SYS_STATUS_GEOFENCE
    health = present
    if flight.fence.breaches:
        health &= ~mavlink.MAV_SYS_STATUS_GEOFENCE
    if not flight.estimator.gps_fix:
        health &= ~mavlink.MAV_SYS_STATUS_SENSOR_GPS
    if not flight.estimator.attitude_ok:
        health &= ~mavlink.MAV_SYS_STATUS_AHRS
    if not flight.estimator.position_ok:
        health &= ~mavlink.MAV_SYS_STATUS_AHRS
    if not with_prearm:
        health &= ~mavlink.MAV_SYS_STATUS_PREARM_CHECK
    if not enables_prearm:
        present &= ~mavlink.MAV_SYS_STATUS_PREARM_CHECK
    health &= ~mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
    if receiver_healthy:
        health |= mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
    for fault in flight.commander.faults if flight.commander is not None else ():
        health &= ~_CONCERNED.get(fault.text, 0)
    return mavlink.MAVLink_sys_status_message(
        present,
        present if flight.armed else present & ~mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS,
        health,
        180,
        milli(max(battery.voltage_v, 0.0)),
        int16(battery.current_a * 100),
        round(battery.left * 100),
        0,
        0,
        0,
        0,
        0,
        0,
    )


def battery_status(flight: Flight) -> Message:
    battery = flight.battery
    voltages = [milli(max(battery.voltage_v, 0.0)), *([65535] * 9)]
    left_s = battery.left * battery.capacity_mah * 3.6 / max(battery.current_a, 0.1)
    return mavlink.MAVLink_battery_status_message(
        0,
        0,
        mavlink.MAV_BATTERY_TYPE_LIPO,
        32767,
        voltages,
        int16(battery.current_a * 100),
        round(battery.used_mah),
        round(battery.used_mah * 3.6 * battery.voltage_v / 100.0),
        round(battery.left * 100),
        round(left_s),
        _charge_state(flight),
    )


def _charge_state(flight: Flight) -> int:
    if flight.failsafes.battery_critical:
        return int(mavlink.MAV_BATTERY_CHARGE_STATE_CRITICAL)
    if flight.failsafes.battery_low:
        return int(mavlink.MAV_BATTERY_CHARGE_STATE_LOW)
    return int(mavlink.MAV_BATTERY_CHARGE_STATE_OK)


_EKF_LEVEL = mavlink.EKF_ATTITUDE | mavlink.EKF_VELOCITY_VERT | mavlink.EKF_POS_VERT_ABS
_EKF_PLACED = (
    _EKF_LEVEL
    | mavlink.EKF_VELOCITY_HORIZ
    | mavlink.EKF_POS_HORIZ_REL
    | mavlink.EKF_POS_HORIZ_ABS
    | mavlink.EKF_PRED_POS_HORIZ_REL
    | mavlink.EKF_PRED_POS_HORIZ_ABS
)
_EKF_STANDING = _EKF_LEVEL | mavlink.EKF_VELOCITY_HORIZ | mavlink.EKF_CONST_POS_MODE
STILL_AIDED_S = 8.0
"""After a loss of position the estimator assumes for this long that it stands still (measured)."""


def ekf_status(flight: Flight) -> Message:
    """Before the first position, and for a while after a loss, it assumes that it stands still. The variances do not
    show this: they stay small."""
    estimator = flight.estimator
    if not estimator.attitude_ok:
        flags = 0
    elif estimator.position_ok:
        flags = _EKF_PLACED
    else:
        flags = _EKF_LEVEL if 0.0 < estimator.lost_for_s < STILL_AIDED_S else _EKF_STANDING
    velocity, horizontal, vertical, compass = flight.body.innovations()
    return mavlink.MAVLink_ekf_status_report_message(flags, velocity, horizontal, vertical, compass, 0.0)


def extended_state(flight: Flight) -> Message:
    if flight.landed:
        state = mavlink.MAV_LANDED_STATE_ON_GROUND
    elif flight.flying.disarms_on_landing:
        state = mavlink.MAV_LANDED_STATE_LANDING
    elif flight.flying.waits_to_take_off:
        state = mavlink.MAV_LANDED_STATE_TAKEOFF
    else:
        state = mavlink.MAV_LANDED_STATE_IN_AIR
    return mavlink.MAVLink_extended_sys_state_message(mavlink.MAV_VTOL_STATE_UNDEFINED, state)


def home_position(flight: Flight) -> Message | None:
    if flight.home is None:
        return None
    north, east, alt = flight.home_local()
    return mavlink.MAVLink_home_position_message(
        e7(flight.home.lat_deg),
        e7(flight.home.lon_deg),
        milli(flight.home.alt_amsl_m),
        north,
        east,
        -alt,
        [1.0, 0.0, 0.0, 0.0],
        0.0,
        0.0,
        0.0,
        us(flight),
    )


def origin(flight: Flight) -> Message | None:
    if not flight.estimator_was_ready:
        return None
    place = flight.origin.origin
    return mavlink.MAVLink_gps_global_origin_message(
        e7(place.lat_deg), e7(place.lon_deg), milli(place.alt_amsl_m), us(flight)
    )


def version_report(major: int, minor: int, patch: int) -> Callable[[Flight], Message]:
    """The report of an official release."""
    version = (major << 24) | (minor << 16) | (patch << 8) | OFFICIAL

    def autopilot_version(_flight: Flight) -> Message:
        return mavlink.MAVLink_autopilot_version_message(
            CAPABILITIES, version, 0, 0, 0, list(b"simulate"), [0] * 8, [0] * 8, 0, 0, 0
        )

    return autopilot_version


def rc_channels(flight: Flight) -> Message:
    """`chancount` is the receiver's own: 0 without a receiver, whatever a ground station sends (measured)."""
    return mavlink.MAVLink_rc_channels_message(ms(flight), flight.sticks.channel_count, *flight.sticks.pwm, 255)


def servo_outputs(flight: Flight) -> Message:
    motors = [round(1000 + 1000 * command) for command in flight.commands]
    servos = flight.outputs.pulses[len(motors) :]
    return mavlink.MAVLink_servo_output_raw_message(us(flight) & 0xFFFFFFFF, 0, *motors, *servos)


def mission_current(flight: Flight) -> Message:
    """The installed dialect has no mission_id, fence_id and rally_points_id yet."""
    plans = flight.plans
    auto = next((one for one in flight.behaviours() if isinstance(one, Auto)), None)
    if not plans.has_mission or auto is None:
        state = mavlink.MISSION_STATE_NO_MISSION
    elif auto.ended:
        state = mavlink.MISSION_STATE_COMPLETE
    elif flight.flying is auto:
        state = mavlink.MISSION_STATE_PAUSED if auto.paused else mavlink.MISSION_STATE_ACTIVE
    else:
        begun = plans.current > plans.first
        state = mavlink.MISSION_STATE_PAUSED if begun else mavlink.MISSION_STATE_NOT_STARTED
    total = max(len(plans.mission) - plans.first, 0)
    return mavlink.MAVLink_mission_current_message(
        plans.current, total, state, 1 if isinstance(flight.flying, Auto) else 2
    )


def fence_status(flight: Flight) -> Message:
    fence = flight.fence
    return mavlink.MAVLink_fence_status_message(
        int(bool(fence.breaches)), fence.count, int(fence.last), round(fence.last_s * 1000), 0
    )


def system_time(flight: Flight) -> Message:
    unix = BOOT_UNIX_US + us(flight) if flight.estimator.gps_fix else 0
    return mavlink.MAVLink_system_time_message(unix, ms(flight))


SHAKEN_M_S2 = 75.0
"""By a propeller out of balance."""


def vibration(flight: Flight) -> Message:
    shaken = SHAKEN_M_S2 if Failure.IMU_NOISE in flight.failures else 3.0
    size = shaken if flight.armed else 0.02
    return mavlink.MAVLink_vibration_message(us(flight), size, size, size, 0, 0, 0)


def power_status(_flight: Flight) -> Message:
    return mavlink.MAVLink_power_status_message(5000, 5000, 0)


def meminfo(_flight: Flight) -> Message:
    return mavlink.MAVLink_meminfo_message(0, 65535, 131072)


HEALTH_REPORTS: dict[int, Callable[[Flight], Message | None]] = {
    0: heartbeat,
    1: sys_status,
    2: system_time,
    36: servo_outputs,
    42: mission_current,
    49: origin,
    65: rc_channels,
    125: power_status,
    147: battery_status,
    148: version_report(4, 6, 2),
    152: meminfo,
    162: fence_status,
    193: ekf_status,
    241: vibration,
    242: home_position,
    245: extended_state,
}
