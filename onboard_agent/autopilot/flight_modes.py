"""What the flight modes of the autopilots mean to the failsafe. Numbers as in AUTOPILOTS: Copter's and PX4's own.

Only what the agent itself decides on stands here: which modes hold, go home and land, and which fly without sticks.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from wire.dialect import mavlink

_PX4_MAIN_SHIFT: Final = 16
_PX4_SUB_SHIFT: Final = 24
_PX4_AUTO: Final = 4
_PX4_WITHOUT_STICKS: Final = frozenset({_PX4_AUTO, 6})
"""AUTO and OFFBOARD."""

_COPTER_WITHOUT_STICKS: Final = frozenset({3, 4, 6, 7, 9, 17, 20, 21, 27})
"""AUTO, GUIDED, RTL, CIRCLE, LAND, BRAKE, GUIDED_NOGPS, SMART_RTL, AUTO_RTL."""

_COPTER_HOLDS_WHEN_CENTRED: Final = frozenset({2, 5, 16})
"""ALT_HOLD, LOITER, POSHOLD."""

_PX4_HOLDS_WHEN_CENTRED: Final = frozenset({2, 3})
"""ALTCTL, POSCTL."""

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
class FlightMode:
    """How to ask for a mode, and the custom_mode by which a heartbeat shows it."""

    name: str
    custom_mode: int
    command_parameters: tuple[float, float]
    """param2 and param3 of MAV_CMD_DO_SET_MODE."""


def px4_custom_mode(main: int, sub: int) -> int:
    """As PX4's heartbeat packs the two numbers that DO_SET_MODE carries apart."""
    return main << _PX4_MAIN_SHIFT | sub << _PX4_SUB_SHIFT


def _copter(name: str, number: int) -> FlightMode:
    return FlightMode(name, number, (number, 0))


def _px4(name: str, main: int, sub: int = 0) -> FlightMode:
    return FlightMode(name, px4_custom_mode(main, sub), (main, sub))


@dataclass(frozen=True)
class Modes:
    """What one kind of vehicle offers to the failsafe."""

    position_holds: tuple[FlightMode, ...]
    altitude_hold: FlightMode
    going_home: tuple[FlightMode, ...]
    """Modes that end on the ground by themselves; nothing is added to them."""
    return_: FlightMode
    land: FlightMode
    mission: FlightMode
    pauses: tuple[FlightMode, ...]
    """Modes that stop a mission in the air and keep the place, without sticks."""


_COPTER: Final = Modes(
    position_holds=(_copter("LOITER", 5), _copter("POSHOLD", 16), _copter("BRAKE", 17)),
    altitude_hold=_copter("ALT_HOLD", 2),
    going_home=(_copter("RTL", 6), _copter("LAND", 9), _copter("SMART_RTL", 21), _copter("AUTO_RTL", 27)),
    return_=_copter("RTL", 6),
    land=_copter("LAND", 9),
    mission=_copter("AUTO", 3),
    pauses=(_copter("BRAKE", 17), _copter("GUIDED", 4)),
)

_PX4: Final = Modes(
    position_holds=(_px4("AUTO.LOITER", _PX4_AUTO, 3), _px4("POSCTL", 3)),
    altitude_hold=_px4("ALTCTL", 2),
    going_home=(_px4("AUTO.RTL", _PX4_AUTO, 5), _px4("AUTO.LAND", _PX4_AUTO, 6), _px4("AUTO.PRECLAND", _PX4_AUTO, 9)),
    return_=_px4("AUTO.RTL", _PX4_AUTO, 5),
    land=_px4("AUTO.LAND", _PX4_AUTO, 6),
    mission=_px4("AUTO.MISSION", _PX4_AUTO, 4),
    pauses=(_px4("AUTO.LOITER", _PX4_AUTO, 3),),
)


def is_copter(vehicle_type: int) -> bool:
    """Whether this MAV_TYPE has rotors alone."""
    return vehicle_type in _COPTERS


def modes_of(autopilot_kind: int, vehicle_type: int) -> Modes | None:
    """The modes of a multicopter, or None for a vehicle of which we know none (a plane, a rover)."""
    if not is_copter(vehicle_type):
        return None
    if autopilot_kind == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA:
        return _COPTER
    if autopilot_kind == mavlink.MAV_AUTOPILOT_PX4:
        return _PX4
    return None


def hold_rungs(modes: Modes | None, names: Sequence[str]) -> tuple[FlightMode, ...]:
    """The drone's ladder: the modes named, in that order, and altitude hold last, whether named or not.

    Names that this kind of vehicle does not have are skipped. Empty where we know no modes.
    """
    if modes is None:
        return ()
    known = {mode.name: mode for mode in modes.position_holds}
    wanted = [known[name] for name in dict.fromkeys(names) if name in known]
    return (*wanted, modes.altitude_hold)


def flies_without_sticks(autopilot_kind: int, custom_mode: int) -> bool:
    """Whether nobody needs to hold the sticks in this mode. An unknown mode counts as one that needs them."""
    if autopilot_kind == mavlink.MAV_AUTOPILOT_PX4:
        return custom_mode >> _PX4_MAIN_SHIFT & 0xFF in _PX4_WITHOUT_STICKS
    return custom_mode in _COPTER_WITHOUT_STICKS


def goes_home(autopilot_kind: int, custom_mode: int) -> bool:
    """Whether a multicopter in this mode ends on the ground by itself."""
    modes = _PX4 if autopilot_kind == mavlink.MAV_AUTOPILOT_PX4 else _COPTER
    return any(mode.custom_mode == custom_mode for mode in modes.going_home)


def holds_when_centred(autopilot_kind: int, custom_mode: int) -> bool:
    """Whether this is a mode of sticks in which centred ones keep level and height. Unknown modes are none."""
    if autopilot_kind == mavlink.MAV_AUTOPILOT_PX4:
        return custom_mode >> _PX4_MAIN_SHIFT & 0xFF in _PX4_HOLDS_WHEN_CENTRED
    return autopilot_kind == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA and custom_mode in _COPTER_HOLDS_WHEN_CENTRED
