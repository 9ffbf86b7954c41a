"""What the flight modes of the autopilots mean to the failsafe. Numbers as in AUTOPILOTS: Copter's and PX4's own.

Only what the agent itself decides on stands here: which mode holds height, and whether a mode flies without sticks.
"""

from dataclasses import dataclass
from typing import Final

from wire.dialect import mavlink

COPTER_ALT_HOLD: Final = 2

_PX4_ALTCTL: Final = 2
_PX4_MAIN_SHIFT: Final = 16
_PX4_SUB_SHIFT: Final = 24
_PX4_WITHOUT_STICKS: Final = frozenset({4, 6})
"""AUTO and OFFBOARD."""

_COPTER_WITHOUT_STICKS: Final = frozenset({3, 4, 6, 7, 9, 17, 20, 21, 27})
"""AUTO, GUIDED, RTL, CIRCLE, LAND, BRAKE, GUIDED_NOGPS, SMART_RTL, AUTO_RTL."""

_COPTERS: Final = frozenset(
    {
        mavlink.MAV_TYPE_QUADROTOR,
        mavlink.MAV_TYPE_COAXIAL,
        mavlink.MAV_TYPE_HELICOPTER,
        mavlink.MAV_TYPE_HEXAROTOR,
        mavlink.MAV_TYPE_OCTOROTOR,
        mavlink.MAV_TYPE_TRICOPTER,
        mavlink.MAV_TYPE_DODECAROTOR,
        mavlink.MAV_TYPE_DECAROTOR,
    }
)


@dataclass(frozen=True)
class HoldMode:
    """A mode that keeps the height: how to ask for it, and the custom_mode by which a heartbeat shows it."""

    name: str
    custom_mode: int
    command_parameters: tuple[float, float]
    """param2 and param3 of MAV_CMD_DO_SET_MODE."""


_ALT_HOLD: Final = HoldMode("ALT_HOLD", COPTER_ALT_HOLD, (COPTER_ALT_HOLD, 0))
_ALTCTL: Final = HoldMode("ALTCTL", _PX4_ALTCTL << _PX4_MAIN_SHIFT, (_PX4_ALTCTL, 0))


def hold_mode(autopilot_kind: int, vehicle_type: int) -> HoldMode | None:
    """The altitude-hold mode, or None where the vehicle has none that we know (a plane, a rover)."""
    if vehicle_type not in _COPTERS:
        return None
    if autopilot_kind == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA:
        return _ALT_HOLD
    if autopilot_kind == mavlink.MAV_AUTOPILOT_PX4:
        return _ALTCTL
    return None


def px4_custom_mode(main: int, sub: int) -> int:
    """As PX4's heartbeat packs the two numbers that DO_SET_MODE carries apart."""
    return main << _PX4_MAIN_SHIFT | sub << _PX4_SUB_SHIFT


def flies_without_sticks(autopilot_kind: int, custom_mode: int) -> bool:
    """Whether nobody needs to hold the sticks in this mode. An unknown mode counts as one that needs them."""
    if autopilot_kind == mavlink.MAV_AUTOPILOT_PX4:
        return custom_mode >> _PX4_MAIN_SHIFT & 0xFF in _PX4_WITHOUT_STICKS
    return custom_mode in _COPTER_WITHOUT_STICKS
