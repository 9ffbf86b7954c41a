"""The commands that fly: mode, arming, take-off, go-to, speed, heading, home, mission."""

from __future__ import annotations

import math

from simulator.arming import FORCE_MAGIC
from simulator.auto import Auto
from simulator.command_message import Command
from simulator.flight import Flight
from simulator.geodesy import Place
from simulator.guided import GoTo, Guided
from simulator.mission_plan import Frame
from simulator.modes import Mode, mode_of
from simulator.notices import Severity
from simulator.setpoints import height_over_origin

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4
"""MAV_RESULT."""

CUSTOM_MODE_FLAG = 1
CHANGE_MODE_FLAG = 1
RELATIVE_FRAMES = (Frame.GLOBAL_RELATIVE, Frame.GLOBAL_RELATIVE_INT)
PLACE_FRAMES = frozenset({0, 3, 5, 6, 10, 11})


def set_mode(flight: Flight, command: Command) -> int:
    if not int(command.params[0]) & CUSTOM_MODE_FLAG:
        return DENIED
    return set_mode_number(flight, int(command.params[1]))


def set_mode_number(flight: Flight, number: int) -> int:
    mode = mode_of(number)
    if mode is None:
        flight.notify(Severity.WARNING, f"No such mode {number}")
        return FAILED
    return ACCEPTED if flight.set_mode(mode) else FAILED


def arm_or_disarm(flight: Flight, command: Command) -> int:
    wanted, forced = command.params[0], command.params[1] == FORCE_MAGIC
    if wanted == 1.0:
        return ACCEPTED if flight.arm(force=forced) else FAILED
    if wanted != 0.0:
        return UNSUPPORTED
    if flight.armed and not flight.landed and not forced:
        return FAILED
    flight.disarm()
    return ACCEPTED


def take_off(flight: Flight, command: Command) -> int:
    if command.frame not in RELATIVE_FRAMES:
        return DENIED
    if not flight.rules(flight.mode).commanded_take_off or not flight.armed or not flight.landed:
        return FAILED
    if not flight.estimator.position_ok or command.alt_m <= flight.alt_over_home_m():
        return FAILED
    return ACCEPTED if flight.behaviour(flight.mode).take_off(command.alt_m) else FAILED


def reposition(flight: Flight, command: Command) -> int:
    may_change = bool(int(command.params[1]) & CHANGE_MODE_FLAG)
    if flight.mode is not Mode.GUIDED and not may_change:
        return DENIED
    if not command.place_is_valid or command.frame not in PLACE_FRAMES:
        return DENIED
    north, east = flight.origin.to_local(command.lat_e7 * 1e-7, command.lon_e7 * 1e-7)
    alt_m = height_over_origin(flight, command.frame, command.alt_m)
    if flight.fence.outside(flight, (north, east), alt_m - flight.home_local()[2]):
        return FAILED
    guided = flight.behaviour(Mode.GUIDED)
    if not flight.set_mode(Mode.GUIDED) or not isinstance(guided, Guided):
        return FAILED
    guided.go(GoTo(north, east, alt_m))
    return ACCEPTED


def change_speed(flight: Flight, command: Command) -> int:
    kind, speed = int(command.params[0]), command.params[1]
    if speed <= 0.0:
        return DENIED
    if kind in (0, 1):
        flight.speed_override_mps = speed
    elif kind == 2:
        flight.parameters.set("WPNAV_SPEED_UP", speed * 100)
    elif kind == 3:
        flight.parameters.set("WPNAV_SPEED_DN", speed * 100)
    else:
        return DENIED
    return ACCEPTED


def turn(flight: Flight, command: Command) -> int:
    angle, _, direction, relative = command.params
    if not 0.0 <= angle <= 360.0 or relative not in (0.0, 1.0):
        return FAILED
    if relative:
        sign = -1.0 if direction < 0 else 1.0
        flight.yaw_override_rad = flight.body.attitude()[2] + sign * math.radians(angle)
    else:
        flight.yaw_override_rad = math.radians(angle)
    flight.roi = None
    return ACCEPTED


def pause_or_continue(flight: Flight, command: Command) -> int:
    behaviour = flight.behaviour(flight.mode)
    if command.params[0] == 0.0:
        if behaviour.pause():
            return ACCEPTED
        flight.notify(Severity.INFO, "Failed to pause")
        return FAILED
    if command.params[0] == 1.0:
        if behaviour.resume():
            return ACCEPTED
        flight.notify(Severity.INFO, "Failed to continue")
        return FAILED
    return DENIED


def set_home(flight: Flight, command: Command) -> int:
    if command.params[0] == 1.0:
        if not flight.estimator.position_ok:
            return FAILED
        flight.set_home(flight.place())
    else:
        if not command.place_is_valid:
            return DENIED
        alt_m = command.alt_m
        if command.frame in RELATIVE_FRAMES and len(command.raw) < 7:
            alt_m += flight.home_local()[2] + flight.origin.origin.alt_amsl_m
        flight.set_home(Place(command.lat_e7 * 1e-7, command.lon_e7 * 1e-7, alt_m))
    flight.home_is_chosen = True
    return ACCEPTED


def start_mission(flight: Flight, command: Command) -> int:
    if command.params[0] or command.params[1]:
        return DENIED
    if not flight.set_mode(Mode.AUTO):
        return FAILED
    auto = flight.behaviour(Mode.AUTO)
    if isinstance(auto, Auto):
        auto.start()
    return ACCEPTED


def set_current_item(flight: Flight, command: Command) -> int:
    """A second parameter of 1 resets the jump counters."""
    done = jump_to_item(flight, int(command.params[0]), reset_jumps=command.params[1] == 1.0)
    return ACCEPTED if done else DENIED


def jump_to_item(flight: Flight, seq: int, *, reset_jumps: bool = False) -> bool:
    auto = next((one for one in flight.behaviours() if isinstance(one, Auto)), None)
    if not 0 <= seq < len(flight.plans.mission) or auto is None:
        return False
    auto.jump_to(max(seq, flight.plans.first), reset_jumps=reset_jumps)
    return True


def terminate(flight: Flight, command: Command) -> int:
    if command.params[0] <= 0.5:
        return FAILED
    flight.disarm()
    flight.notify(Severity.EMERGENCY, "Terminating due to GCS request")
    return ACCEPTED


def run_checks(flight: Flight, command: Command) -> int:
    del command
    if flight.armed:
        return TEMPORARILY_REJECTED
    reason = flight.why_not_ready()
    if reason is not None:
        flight.notify(Severity.CRITICAL, reason)
    return ACCEPTED
