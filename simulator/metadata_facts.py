"""Metadata of the parameters that the simulator uses: units, values, bits, and a few descriptions."""

from __future__ import annotations

from typing import Any

from simulator import failsafe
from simulator.modes import Mode
from simulator.px4 import failsafe as px4_failsafe

_UNITS = {
    "cm": ("RTL_ALT", "RTL_ALT_FINAL", "RTL_CLIMB_MIN", "WPNAV_RADIUS", "CIRCLE_RADIUS", "LAND_ALT_LOW"),
    "cm/s": ("WPNAV_SPEED", "WPNAV_SPEED_UP", "WPNAV_SPEED_DN", "LOIT_SPEED", "LAND_SPEED", "PILOT_SPEED_UP"),
    "cm/s^2": ("WPNAV_ACCEL", "WPNAV_ACCEL_Z", "LOIT_ACC_MAX", "PILOT_ACCEL_Z"),
    "m": ("FENCE_ALT_MAX", "FENCE_ALT_MIN", "FENCE_RADIUS", "RTL_RETURN_ALT", "RTL_DESCEND_ALT", "MIS_TAKEOFF_ALT"),
    "m/s": ("MPC_XY_CRUISE", "MPC_XY_VEL_MAX", "MPC_Z_VEL_MAX_UP", "MPC_Z_VEL_MAX_DN", "MPC_LAND_SPEED"),
    "s": ("RC_OVERRIDE_TIME", "RC_FS_TIMEOUT", "FS_GCS_TIMEOUT", "COM_RC_LOSS_T", "COM_DL_LOSS_T", "COM_FAIL_ACT_T"),
    "mAh": ("BATT_CAPACITY", "BAT1_CAPACITY"),
}
_UNIT_OF = {name: unit for unit, names in _UNITS.items() for name in names}

_MODES = {mode.value: mode.name for mode in Mode}
_LINK_ACTIONS = {
    px4_failsafe.NOTHING: "Nothing",
    px4_failsafe.HOLD: "Hold",
    px4_failsafe.RETURN: "Return",
    px4_failsafe.LAND: "Land",
    px4_failsafe.TERMINATE: "Terminate",
    px4_failsafe.DISARM: "Disarm",
}
_VALUES = {f"FLTMODE{number}": _MODES for number in range(1, 7)} | {
    "NAV_RCL_ACT": _LINK_ACTIONS,
    "NAV_DLL_ACT": _LINK_ACTIONS,
}
_BITS = {
    "FS_OPTIONS": {
        failsafe.CONTINUE_AUTO_ON_RADIO_LOSS: "Continue AUTO when the radio is lost",
        failsafe.CONTINUE_AUTO_ON_GCS_LOSS: "Continue AUTO when the ground station is lost",
        failsafe.CONTINUE_GUIDED_ON_RADIO_LOSS: "Continue GUIDED when the radio is lost",
        failsafe.CONTINUE_LANDING: "Continue a landing",
        failsafe.CONTINUE_PILOTED_ON_GCS_LOSS: "Fly on by hand when the ground station is lost",
    },
    "COM_RCL_EXCEPT": {1: "Mission", 2: "Hold", 4: "Offboard"},
}
_RANGES = {"RTL_ALT": (30.0, 300000.0), "COM_RC_LOSS_T": (0.0, 35.0), "RTL_RETURN_ALT": (0.0, 1000.0)}
_RESTARTS = frozenset({"SYSID_THISMAV", "MAV_SYS_ID", "SYS_AUTOSTART"})
_WORDS = {"RTL_ALT": "Height of a return", "RTL_RETURN_ALT": "Height of a return", "NAV_RCL_ACT": "When sticks stop"}


def facts_of(name: str) -> dict[str, Any]:
    """Returns the fields of parameter.schema.json that are known for this parameter."""
    facts: dict[str, Any] = {}
    if name in _WORDS:
        facts["shortDesc"] = _WORDS[name]
    if name in _UNIT_OF:
        facts["units"] = _UNIT_OF[name]
    if name in _VALUES:
        facts["values"] = [{"value": value, "description": words} for value, words in _VALUES[name].items()]
    if name in _BITS:
        facts["bitmask"] = [{"index": bit.bit_length() - 1, "description": words} for bit, words in _BITS[name].items()]
    if name in _RANGES:
        facts["min"], facts["max"] = _RANGES[name]
    if name in _RESTARTS:
        facts["rebootRequired"] = True
    return facts
