"""How PX4 answers commands. Heights are above sea level; NaN means "unchanged"."""

from __future__ import annotations

import math
from collections.abc import Callable

from simulator import commands_flight as fly
from simulator.auto import Auto
from simulator.command_message import Command
from simulator.commands import HANDLERS as COMMON
from simulator.commands_camera import CAMERA_HANDLERS
from simulator.dialect import mavlink
from simulator.flight import Flight
from simulator.guided import GoTo, Guided
from simulator.notices import Severity
from simulator.px4 import payload
from simulator.px4.calibration import calibrate, spin_motor
from simulator.px4.modes import STICK_MODES, Orbiting, Px4Mode, TakingOff, custom_mode, mode_of

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4
CUSTOM_MODE_FLAG = 1
CHANGE_MODE_FLAG = 1
AMSL_FRAMES = (0, 5)
ORBIT_SPEED_MPS = 3.0
NO_PLACE = 0x7FFFFFFF


def change_mode(flight: Flight, mode: Px4Mode) -> int:
    """While armed, refuses a mode without its prerequisites: sticks, a position, a mission."""
    if flight.armed and mode in STICK_MODES and flight.sticks.silent_for_s(flight.now_s) > 0.0:
        flight.notify(Severity.CRITICAL, f"Mode {mode.name} not available: no manual control input")
        return TEMPORARILY_REJECTED
    if not flight.set_mode(mode):
        return TEMPORARILY_REJECTED
    flight.failsafes.mode_commanded()
    return ACCEPTED


def set_mode(flight: Flight, command: Command) -> int:
    flags, main, sub = (int(value) for value in command.params[:3])
    if not flags & CUSTOM_MODE_FLAG:
        return DENIED
    mode = mode_of(custom_mode(main, sub))
    return change_mode(flight, mode) if mode is not None else DENIED


def set_mode_number(flight: Flight, number: int) -> int:
    mode = mode_of(number)
    return change_mode(flight, mode) if mode is not None else DENIED


def arm_or_disarm(flight: Flight, command: Command) -> int:
    answer = fly.arm_or_disarm(flight, command)
    return TEMPORARILY_REJECTED if answer == FAILED else answer


def take_off(flight: Flight, command: Command) -> int:
    """AUTO.TAKEOFF: climbs when (or as soon as) it is armed, to a height above sea level."""
    behaviour = flight.behaviour(Px4Mode.TAKEOFF)
    if isinstance(behaviour, TakingOff):
        given = command.alt_is_given
        behaviour.alt_over_origin_m = command.alt_m - flight.origin.origin.alt_amsl_m if given else None
    if not flight.landed:
        return TEMPORARILY_REJECTED
    return change_mode(flight, Px4Mode.TAKEOFF)


def reposition(flight: Flight, command: Command) -> int:
    if command.frame not in AMSL_FRAMES and not command.is_long:
        return DENIED
    if int(command.params[1]) & CHANGE_MODE_FLAG:
        answer = change_mode(flight, Px4Mode.LOITER)
        if answer != ACCEPTED:
            return answer
    hold = flight.behaviour(Px4Mode.LOITER)
    if flight.mode is not Px4Mode.LOITER or not isinstance(hold, Guided):
        return ACCEPTED  # accepted and ignored
    if names_nothing(command):
        hold.enter()
        return ACCEPTED
    if not command.place_is_valid:
        return DENIED
    if command.params[0] > 0.0:
        flight.speed_override_mps = command.params[0]
    north_m, east_m = flight.origin.to_local(command.lat_e7 * 1e-7, command.lon_e7 * 1e-7)
    alt_m = command.alt_m - flight.origin.origin.alt_amsl_m if command.alt_is_given else flight.target.alt_m
    yaw_rad = command.params[3] if math.isfinite(command.params[3]) else None
    if outside_limits(flight, north_m, east_m):
        flight.notify(Severity.CRITICAL, "Reposition is outside geofence")
        return ACCEPTED  # and stands still (measured on 1.16)
    hold.go(GoTo(north_m, east_m, alt_m, yaw_rad))
    return ACCEPTED


def names_nothing(command: Command) -> bool:
    """No place, no height, no heading: it stops where it is. (Measured on 1.16: to ask for its mode again does not.)"""
    if not command.is_long:
        return command.lat_e7 == NO_PLACE and not command.alt_is_given and not math.isfinite(command.given[3])
    return not any(math.isfinite(value) for value in command.given[3:])


def outside_limits(flight: Flight, north_m: float, east_m: float) -> bool:
    """Whether a place is farther from home than GF_MAX_HOR_DIST."""
    limit_m, home = flight.parameters["GF_MAX_HOR_DIST"], flight.home_local()
    return bool(flight.parameters.whole("GF_ACTION") and 0 < limit_m < math.hypot(north_m - home[0], east_m - home[1]))


def orbit(flight: Flight, command: Command) -> int:
    """Orbits a position, nose inwards, at a height above sea level. Values not given stay unchanged."""
    radius_m, speed_mps = command.params[:2]
    if flight.landed or not command.place_is_valid or abs(radius_m) < 1.0:
        return DENIED
    answer = change_mode(flight, Px4Mode.ORBIT)
    around = flight.behaviour(Px4Mode.ORBIT)
    if answer == ACCEPTED and isinstance(around, Orbiting):
        centre = flight.origin.to_local(command.lat_e7 * 1e-7, command.lon_e7 * 1e-7)
        alt_m = command.alt_m - flight.origin.origin.alt_amsl_m if command.alt_is_given else flight.target.alt_m
        around.go_round(centre, radius_m, abs(speed_mps) or ORBIT_SPEED_MPS, alt_m)
    return answer


def change_speed(flight: Flight, command: Command) -> int:
    if command.params[1] <= 0.0:
        return DENIED
    flight.speed_override_mps = command.params[1]
    return ACCEPTED


def pause_or_continue(flight: Flight, command: Command) -> int:
    return change_mode(flight, Px4Mode.MISSION if command.params[0] else Px4Mode.LOITER)


def start_mission(flight: Flight, command: Command) -> int:
    """Starts at the item of param1, if there is one, and arms if necessary."""
    answer = change_mode(flight, Px4Mode.MISSION)
    auto = flight.behaviour(Px4Mode.MISSION)
    if answer == ACCEPTED and isinstance(auto, Auto):
        if not flight.arm():
            return TEMPORARILY_REJECTED
        fly.jump_to_item(flight, int(command.params[0]))
        auto.start()
    return answer


def _into(mode: Px4Mode) -> Callable[[Flight, Command], int]:
    return lambda flight, _command: change_mode(flight, mode)


_KEPT = (
    mavlink.MAV_CMD_DO_SET_HOME,
    mavlink.MAV_CMD_DO_FLIGHTTERMINATION,
    mavlink.MAV_CMD_RUN_PREARM_CHECKS,
)

HANDLERS: dict[int, Callable[[Flight, Command], int]] = {
    **{number: COMMON[number] for number in _KEPT},
    **CAMERA_HANDLERS,
    mavlink.MAV_CMD_PREFLIGHT_CALIBRATION: calibrate,
    mavlink.MAV_CMD_ACTUATOR_TEST: spin_motor,
    mavlink.MAV_CMD_DO_SET_ACTUATOR: payload.set_actuator,
    mavlink.MAV_CMD_DO_GRIPPER: payload.move_gripper,
    mavlink.MAV_CMD_DO_SET_MODE: set_mode,
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: arm_or_disarm,
    mavlink.MAV_CMD_NAV_TAKEOFF: take_off,
    mavlink.MAV_CMD_NAV_LAND: _into(Px4Mode.LAND),
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: _into(Px4Mode.RTL),
    mavlink.MAV_CMD_NAV_LOITER_UNLIM: _into(Px4Mode.LOITER),
    mavlink.MAV_CMD_DO_REPOSITION: reposition,
    mavlink.MAV_CMD_DO_ORBIT: orbit,
    mavlink.MAV_CMD_DO_CHANGE_SPEED: change_speed,
    mavlink.MAV_CMD_DO_PAUSE_CONTINUE: pause_or_continue,
    mavlink.MAV_CMD_MISSION_START: start_mission,
}
