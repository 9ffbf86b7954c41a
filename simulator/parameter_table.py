"""The default parameter table: ArduCopter 4.6 names, types and (mostly) default values.

Where the real autopilot's default differs from the one in its own simulator, this table has the simulator's (radio
ranges, flight modes on channel 5), and the battery failsafe is enabled. This table has the parameters that the
simulator uses, and measured values; the rest of a real vehicle's list is in `parameter_groups`.
"""

from __future__ import annotations

from simulator.parameter_groups.equipment import EQUIPMENT
from simulator.parameter_groups.flying import FLYING
from simulator.parameter_groups.sensing import SENSING
from simulator.parameter_notation import Kind

__all__ = ["TABLE", "Kind"]

_I8, _I16, _I32, _F = Kind.INT8, Kind.INT16, Kind.INT32, Kind.FLOAT

_COPTER: list[tuple[str, Kind, float]] = [
    ("FORMAT_VERSION", _I16, 120),
    ("SYSID_THISMAV", _I16, 1),
    ("SYSID_MYGCS", _I16, 255),
    ("PILOT_THR_FILT", _F, 0),
    ("PILOT_TKOFF_ALT", _F, 0),
    ("PILOT_THR_BHV", _I16, 0),
    ("TELEM_DELAY", _I8, 0),
    ("RTL_ALT", _I32, 1500),
    ("RTL_CONE_SLOPE", _F, 3),
    ("RTL_SPEED", _I16, 0),
    ("RTL_ALT_FINAL", _I16, 0),
    ("RTL_CLIMB_MIN", _I16, 0),
    ("RTL_LOIT_TIME", _I32, 5000),
    ("RTL_ALT_TYPE", _I8, 0),
    ("FS_GCS_ENABLE", _I8, 0),
    ("FS_GCS_TIMEOUT", _F, 5),
    ("GPS_HDOP_GOOD", _I16, 140),
    ("SUPER_SIMPLE", _I8, 0),
    ("WP_YAW_BEHAVIOR", _I8, 2),
    ("LAND_SPEED", _I16, 50),
    ("LAND_SPEED_HIGH", _I16, 0),
    ("LAND_ALT_LOW", _I16, 1000),
    ("LAND_REPOSITION", _I8, 1),
    ("PILOT_SPEED_UP", _I16, 250),
    ("PILOT_SPEED_DN", _I16, 0),
    ("PILOT_ACCEL_Z", _I16, 250),
    ("PILOT_Y_RATE", _F, 202.5),
    ("PILOT_Y_EXPO", _F, 0),
    ("FS_THR_ENABLE", _I8, 1),
    ("FS_THR_VALUE", _I16, 975),
    ("THR_DZ", _I16, 100),
    ("FLTMODE1", _I8, 7),
    ("FLTMODE2", _I8, 9),
    ("FLTMODE3", _I8, 6),
    ("FLTMODE4", _I8, 3),
    ("FLTMODE5", _I8, 5),
    ("FLTMODE6", _I8, 0),
    ("FLTMODE_CH", _I8, 5),
    ("INITIAL_MODE", _I8, 0),
    ("SIMPLE", _I8, 0),
    ("LOG_BITMASK", _I32, 176126),
    ("ANGLE_MAX", _I16, 3000),
    ("PHLD_BRAKE_RATE", _I16, 8),
    ("PHLD_BRAKE_ANGLE", _I16, 3000),
    ("DISARM_DELAY", _I8, 10),
    ("FS_EKF_ACTION", _I8, 1),
    ("FS_EKF_THRESH", _F, 0.8),
    ("FS_CRASH_CHECK", _I8, 1),
    ("FS_VIBE_ENABLE", _I8, 1),
    ("FS_DR_ENABLE", _I8, 2),
    ("FS_DR_TIMEOUT", _I16, 30),
    ("FS_OPTIONS", _I32, 16),
    ("RC_SPEED", _I16, 490),
    ("GUID_OPTIONS", _I32, 0),
    ("GUID_TIMEOUT", _F, 3),
    ("AUTO_OPTIONS", _I32, 0),
    ("FRAME_CLASS", _I8, 1),
    ("FRAME_TYPE", _I8, 1),
    ("ARMING_CHECK", _I32, 1),
    ("ARMING_REQUIRE", _I8, 1),
    ("ARMING_RUDDER", _I8, 2),
    ("ARMING_ACCTHRESH", _F, 0.75),
    ("BRD_BOOT_DELAY", _I16, 0),
    ("COMPASS_USE", _I8, 1),
    ("COMPASS_AUTODEC", _I8, 1),
    ("CIRCLE_RADIUS", _F, 1000),
    ("CIRCLE_RATE", _F, 20),
    ("CIRCLE_OPTIONS", _I16, 1),
    ("WPNAV_SPEED", _F, 1000),
    ("WPNAV_RADIUS", _F, 200),
    ("WPNAV_SPEED_UP", _F, 250),
    ("WPNAV_SPEED_DN", _F, 150),
    ("WPNAV_ACCEL", _F, 250),
    ("WPNAV_ACCEL_Z", _F, 100),
    ("WPNAV_JERK", _F, 1),
    ("LOIT_SPEED", _F, 1250),
    ("LOIT_ACC_MAX", _F, 500),
    ("LOIT_ANG_MAX", _F, 0),
    ("LOIT_BRK_ACCEL", _F, 250),
    ("LOIT_BRK_DELAY", _F, 1),
    ("LOIT_BRK_JERK", _F, 500),
    ("FENCE_ENABLE", _I8, 0),
    ("FENCE_TYPE", _I8, 7),
    ("FENCE_ACTION", _I8, 1),
    ("FENCE_ALT_MAX", _F, 100),
    ("FENCE_ALT_MIN", _F, -10),
    ("FENCE_RADIUS", _F, 300),
    ("FENCE_MARGIN", _F, 2),
    ("FENCE_TOTAL", _I8, 0),
    ("MIS_TOTAL", _I16, 0),
    ("MIS_RESTART", _I8, 0),
    ("MIS_OPTIONS", _I16, 0),
    ("RALLY_TOTAL", _I8, 0),
    ("RALLY_LIMIT_KM", _F, 0.3),
    ("RALLY_INCL_HOME", _I8, 1),
    ("LOG_BACKEND_TYPE", _I8, 1),
    ("LOG_DISARMED", _I8, 0),
    ("EK3_ENABLE", _I8, 1),
    ("EK3_SRC1_POSXY", _I8, 3),
    ("EK3_SRC1_VELXY", _I8, 3),
    ("EK3_SRC1_POSZ", _I8, 1),
    ("EK3_SRC1_YAW", _I8, 1),
    ("AHRS_EKF_TYPE", _I8, 3),
    ("AHRS_ORIENTATION", _I8, 0),
    ("GPS1_TYPE", _I8, 1),
    ("GPS2_TYPE", _I8, 0),
    ("GPS_AUTO_SWITCH", _I8, 1),
    ("INS_GYRO_FILTER", _I16, 20),
    ("INS_ACCEL_FILTER", _I16, 20),
    ("SCHED_LOOP_RATE", _I16, 400),
    ("SERIAL0_BAUD", _I32, 115),
    ("SERIAL0_PROTOCOL", _I8, 2),
    ("SERIAL1_BAUD", _I32, 57),
    ("SERIAL1_PROTOCOL", _I8, 2),
]

_BATTERY: list[tuple[str, Kind, float]] = [
    ("BATT_MONITOR", _I8, 4),
    ("BATT_CAPACITY", _I32, 5200),
    ("BATT_SERIAL_NUM", _I32, -1),
    ("BATT_LOW_TIMER", _I8, 10),
    ("BATT_LOW_VOLT", _F, 14.0),
    ("BATT_LOW_MAH", _F, 0),
    ("BATT_CRT_VOLT", _F, 13.2),
    ("BATT_CRT_MAH", _F, 0),
    ("BATT_FS_LOW_ACT", _I8, 2),
    ("BATT_FS_CRT_ACT", _I8, 1),
    ("BATT_ARM_VOLT", _F, 0),
    ("BATT_ARM_MAH", _I32, 0),
]

_TUNING: list[tuple[str, Kind, float]] = [
    ("ATC_ACCEL_P_MAX", _F, 110000),
    ("ATC_ACCEL_R_MAX", _F, 110000),
    ("ATC_ACCEL_Y_MAX", _F, 27000),
    ("ATC_ANG_PIT_P", _F, 4.5),
    ("ATC_ANG_RLL_P", _F, 4.5),
    ("ATC_ANG_YAW_P", _F, 4.5),
    ("ATC_INPUT_TC", _F, 0.15),
    ("ATC_RAT_PIT_P", _F, 0.135),
    ("ATC_RAT_PIT_I", _F, 0.135),
    ("ATC_RAT_PIT_D", _F, 0.0036),
    ("ATC_RAT_RLL_P", _F, 0.135),
    ("ATC_RAT_RLL_I", _F, 0.135),
    ("ATC_RAT_RLL_D", _F, 0.0036),
    ("ATC_RAT_YAW_P", _F, 0.18),
    ("ATC_RAT_YAW_I", _F, 0.018),
    ("ATC_SLEW_YAW", _F, 6000),
    ("PSC_POSXY_P", _F, 1),
    ("PSC_POSZ_P", _F, 1),
    ("PSC_VELXY_P", _F, 2),
    ("PSC_VELXY_I", _F, 1),
    ("PSC_VELZ_P", _F, 5),
    ("PSC_ACCZ_P", _F, 0.5),
    ("PSC_ACCZ_I", _F, 1),
    ("PSC_ANGLE_MAX", _F, 0),
    ("MOT_SPIN_ARM", _F, 0.06),
    ("MOT_SPIN_MIN", _F, 0.15),
    ("MOT_SPIN_MAX", _F, 0.95),
    ("MOT_THST_EXPO", _F, 0.65),
    ("MOT_THST_HOVER", _F, 0.45),
    ("MOT_PWM_MIN", _I16, 1000),
    ("MOT_PWM_MAX", _I16, 2000),
]

_RADIO: list[tuple[str, Kind, float]] = [
    ("RCMAP_ROLL", _I8, 1),
    ("RCMAP_PITCH", _I8, 2),
    ("RCMAP_THROTTLE", _I8, 3),
    ("RCMAP_YAW", _I8, 4),
    ("RC_OVERRIDE_TIME", _F, 3),
    ("RC_OPTIONS", _I32, 32),
    ("RC_PROTOCOLS", _I32, 1),
    ("RC_FS_TIMEOUT", _F, 1),
]

_DEAD_ZONES = {1: 20, 2: 20, 3: 30, 4: 20}

_CHANNELS: list[tuple[str, Kind, float]] = [
    row
    for channel in range(1, 17)
    for row in (
        (f"RC{channel}_MIN", _I16, 1000.0),
        (f"RC{channel}_TRIM", _I16, 1500.0),
        (f"RC{channel}_MAX", _I16, 2000.0),
        (f"RC{channel}_REVERSED", _I8, 0.0),
        (f"RC{channel}_DZ", _I16, float(_DEAD_ZONES.get(channel, 0))),
        (f"RC{channel}_OPTION", _I16, 0.0),
    )
]

_STREAMS: list[tuple[str, Kind, float]] = [
    (f"SR{port}_{group}", _I16, 0.0)
    for port in range(3)
    for group in (
        "RAW_SENS",
        "EXT_STAT",
        "RC_CHAN",
        "RAW_CTRL",
        "POSITION",
        "EXTRA1",
        "EXTRA2",
        "EXTRA3",
        "PARAMS",
    )
]

_SIMULATED: list[tuple[str, Kind, float]] = [
    ("SIM_SPEEDUP", _F, 1),
    ("SIM_RATE_HZ", _I16, 1200),
]
"""Only a simulated ArduPilot has these; their names identify it. They are listed but have no effect."""

TABLE: list[tuple[str, Kind, float]] = [
    *_COPTER,
    *_BATTERY,
    *_TUNING,
    *_RADIO,
    *_CHANNELS,
    *_STREAMS,
    *FLYING,
    *SENSING,
    *EQUIPMENT,
    *_SIMULATED,
]
