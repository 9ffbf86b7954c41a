"""PX4's parameters: names and defaults, integers that travel as bits, and their meaning for the controllers.

The controllers read their limits by ArduCopter's names; `_MEANING` maps each to PX4's parameters.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from zlib import crc32

from simulator.parameter_table import Kind
from simulator.parameters import Parameter, Parameters

_I32, _F = Kind.INT32, Kind.FLOAT

TABLE: list[tuple[str, Kind, float]] = [
    ("MAV_SYS_ID", _I32, 1),
    ("MAV_COMP_ID", _I32, 1),
    ("MAV_TYPE", _I32, 2),
    ("SYS_AUTOSTART", _I32, 4001),
    ("SYS_HITL", _I32, 0),
    ("SIM_GZ_EN", _I32, 1),  # as in the simulation with Gazebo; no effect here
    ("COM_RC_IN_MODE", _I32, 3),
    ("COM_RC_LOSS_T", _F, 0.5),
    ("COM_RC_OVERRIDE", _I32, 1),
    ("COM_RC_STICK_OV", _F, 30),
    ("COM_RCL_EXCEPT", _I32, 0),
    ("COM_DL_LOSS_T", _I32, 10),
    ("COM_DLL_EXCEPT", _I32, 0),
    ("COM_FAIL_ACT_T", _F, 5),
    ("COM_OF_LOSS_T", _F, 1),
    ("COM_OBL_RC_ACT", _I32, 0),
    ("COM_LOW_BAT_ACT", _I32, 0),
    ("COM_ARM_WO_GPS", _I32, 1),
    ("COM_DISARM_LAND", _F, 2),
    ("COM_DISARM_PRFLT", _F, 10),
    ("COM_POSCTL_NAVL", _I32, 0),
    ("COM_HOME_EN", _I32, 1),
    ("NAV_RCL_ACT", _I32, 2),
    ("NAV_DLL_ACT", _I32, 0),
    ("NAV_ACC_RAD", _F, 2),
    ("NAV_MC_ALT_RAD", _F, 0.8),
    ("GF_ACTION", _I32, 2),
    ("GF_MAX_HOR_DIST", _F, 0),
    ("GF_MAX_VER_DIST", _F, 0),
    ("RTL_RETURN_ALT", _F, 60),
    ("RTL_DESCEND_ALT", _F, 30),
    ("RTL_LAND_DELAY", _F, 0),
    ("RTL_TYPE", _I32, 0),
    ("RTL_CONE_ANG", _I32, 45),
    ("MIS_TAKEOFF_ALT", _F, 2.5),
    ("MPC_XY_CRUISE", _F, 5),
    ("MPC_XY_VEL_MAX", _F, 12),
    ("MPC_VEL_MANUAL", _F, 10),
    ("MPC_Z_V_AUTO_UP", _F, 3),
    ("MPC_Z_V_AUTO_DN", _F, 1.5),
    ("MPC_Z_VEL_MAX_UP", _F, 3),
    ("MPC_Z_VEL_MAX_DN", _F, 1.5),
    ("MPC_ACC_HOR", _F, 3),
    ("MPC_ACC_HOR_MAX", _F, 5),
    ("MPC_ACC_UP_MAX", _F, 4),
    ("MPC_LAND_SPEED", _F, 0.7),
    ("MPC_TKO_SPEED", _F, 1.5),
    ("MPC_MAN_TILT_MAX", _F, 35),
    ("MPC_TILTMAX_AIR", _F, 45),
    ("MPC_MAN_Y_MAX", _F, 150),
    ("MPC_HOLD_DZ", _F, 0.1),
    ("MPC_THR_HOVER", _F, 0.5),
    ("BAT1_CAPACITY", _F, 5200),
    ("BAT1_N_CELLS", _I32, 4),
    ("BAT_LOW_THR", _F, 0.15),
    ("BAT_CRIT_THR", _F, 0.07),
    ("BAT_EMERGEN_THR", _F, 0.05),
    ("CBRK_SUPPLY_CHK", _I32, 0),
    ("EKF2_HGT_REF", _I32, 1),
    ("SDLOG_MODE", _I32, 0),
    ("PD_GRIPPER_EN", _I32, 0),
    *[
        row
        for channel in range(1, 9)
        for row in (
            (f"RC{channel}_MIN", _F, 1000.0),
            (f"RC{channel}_TRIM", _F, 1500.0),
            (f"RC{channel}_MAX", _F, 2000.0),
            (f"RC{channel}_REV", _F, 1.0),
        )
    ],
    ("RC_MAP_ROLL", _I32, 1),
    ("RC_MAP_PITCH", _I32, 2),
    ("RC_MAP_THROTTLE", _I32, 3),
    ("RC_MAP_YAW", _I32, 4),
    ("RC_MAP_FLTMODE", _I32, 0),
]

_MEANING: dict[str, Callable[[Parameters], float]] = {
    "WPNAV_SPEED": lambda p: p["MPC_XY_CRUISE"] * 100,
    "WPNAV_SPEED_UP": lambda p: p["MPC_Z_V_AUTO_UP"] * 100,
    "WPNAV_SPEED_DN": lambda p: p["MPC_Z_V_AUTO_DN"] * 100,
    "WPNAV_ACCEL": lambda p: p["MPC_ACC_HOR"] * 100,
    "WPNAV_ACCEL_Z": lambda _: 150.0,
    "WPNAV_RADIUS": lambda p: p["NAV_ACC_RAD"] * 100,
    "LOIT_SPEED": lambda p: p["MPC_VEL_MANUAL"] * 100,
    "LOIT_ACC_MAX": lambda p: p["MPC_ACC_HOR_MAX"] * 100,
    "LOIT_BRK_ACCEL": lambda p: p["MPC_ACC_HOR"] * 100,
    "ANGLE_MAX": lambda p: p["MPC_MAN_TILT_MAX"] * 100,
    "PILOT_Y_RATE": lambda p: p["MPC_MAN_Y_MAX"],
    "PILOT_ACCEL_Z": lambda p: p["MPC_ACC_UP_MAX"] * 100,
    "LAND_SPEED": lambda p: p["MPC_LAND_SPEED"] * 100,
    "LAND_SPEED_HIGH": lambda _: 0.0,
    "LAND_ALT_LOW": lambda _: 500.0,
    "RTL_ALT": lambda p: p["RTL_RETURN_ALT"] * 100,
    "RTL_CONE_SLOPE": lambda _: 1.0,  # the 45 degrees of RTL_CONE_ANG
    "RTL_CLIMB_MIN": lambda _: 0.0,
    "RTL_SPEED": lambda _: 0.0,
    "RTL_LOIT_TIME": lambda p: p["RTL_LAND_DELAY"] * 1000,
    "GUID_TIMEOUT": lambda p: p["COM_OF_LOSS_T"],
    "WP_YAW_BEHAVIOR": lambda _: 1.0,
    "CIRCLE_RATE": lambda _: 20.0,
    "CIRCLE_RADIUS": lambda _: 1000.0,
    "MIS_RESTART": lambda _: 0.0,
    "RALLY_LIMIT_KM": lambda _: 0.0,
    "RALLY_INCL_HOME": lambda _: 1.0,
}


class Px4Parameters(Parameters):
    table = TABLE

    def _follow(self) -> None:
        for name, meaning in _MEANING.items():
            self._values[name] = meaning(self)

    def on_the_wire(self, parameter: Parameter) -> float:
        """Returns the four bytes of an integer, reinterpreted as a float: PX4 copies bits, it does not cast."""
        if parameter.kind is Kind.FLOAT:
            return parameter.value
        bits: float = struct.unpack("<f", struct.pack("<i", int(parameter.value)))[0]
        return bits

    def hash_on_the_wire(self) -> float:
        """CRC-32 over the name and the four bytes of each, its bits reinterpreted as a float."""
        crc = 0
        for parameter in self:
            layout = "<f" if parameter.kind is Kind.FLOAT else "<i"
            value = parameter.value if parameter.kind is Kind.FLOAT else int(parameter.value)
            crc = crc32(parameter.name.encode() + struct.pack(layout, value), crc)
        crc &= ~0x0080_0000  # prevents a NaN, which a float would not carry unchanged
        bits: float = struct.unpack("<f", struct.pack("<I", crc))[0]
        return bits

    def from_the_wire(self, name: str, value: float, kind: int) -> Parameter | None:
        """None if the parameter does not exist, or the sender states the wrong type."""
        parameter = self.find(name)
        if parameter is None or kind != parameter.kind:
            return None
        if parameter.kind is not Kind.FLOAT:
            value = float(struct.unpack("<i", struct.pack("<f", value))[0])
        return self.set(name, value)


def make_parameters(overrides: Iterable[tuple[str, float]] = (), total_count: int = 0) -> Px4Parameters:
    return Px4Parameters(overrides, total_count)
