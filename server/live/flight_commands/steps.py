"""What a command becomes for this vehicle: MAV_CMDs, one after the other, up to the first that is not accepted. Pure.

Facts: ArduCopter reads heights in the frame of the message, PX4 above the sea, whatever the frame. ArduCopter cannot
be armed in most modes; PX4 takes off when it is armed, and arms for a mission start. ArduPilot's item 0 is home.
"""

from __future__ import annotations

from typing import Final, assert_never

from server.domain.refusal import Refusal
from server.live.flight_commands.bodies import (
    Arm,
    ChangeMode,
    ChangeSpeed,
    Disarm,
    GoTo,
    Jump,
    LookAt,
    OneOff,
    Orbit,
    SetHome,
    Simple,
    Start,
    TakeOff,
    Turn,
)
from server.live.flight_commands.vehicle import NotKnownHow, Vehicle
from server.live.operations.operation import Lane, Order, Step
from server.live.relay.policy import FORCE_DISARM
from wire.dialect import mavlink
from wire.transactions import CommandWork, Outcome

_M: Final = mavlink
_BESIDE: Final = (Arm, ChangeSpeed, LookAt, SetHome, Turn)
"""What leaves it flying as it does."""
ANSWER_WITHIN_S: Final = 8.0
"""Four tries of the agent, and what is left for a last answer. Later than that it must not be carried out."""

_CUSTOM_MODE: Final = 1.0
_GROUND_SPEED: Final = 1.0
_AS_IT_IS: Final = -1.0
_CHANGE_MODE: Final = 1.0
_ABOVE_SEA: Final = int(_M.MAV_FRAME_GLOBAL)
_ABOVE_HOME: Final = int(_M.MAV_FRAME_GLOBAL_RELATIVE_ALT)
_HOLD: Final = {True: "AUTO.LOITER", False: "BRAKE"}
_LAND: Final = {True: "AUTO.LAND", False: "LAND"}
_RETURN: Final = {True: "AUTO.RTL", False: "RTL"}
_MISSION: Final = {True: "AUTO.MISSION", False: "AUTO"}


class NoSuchItem(Refusal):
    """Beyond the plan that is on board."""


def order_of(command: OneOff, vehicle: Vehicle) -> Order:
    """Raises NotKnownHow, NotKnownYet, NoSuchMode, NoSuchItem."""
    about: dict[str, object] = command.model_dump(exclude_none=True)

    def say(step: Step, outcome: Outcome, words: str, seen: bool | None) -> str:
        if outcome is Outcome.DONE and seen is None:
            return f"{vehicle.name} has accepted it: {step.phase}."
        return f"{vehicle.name}, {step.phase}: {words}"

    steps, overrules = steps_of(command, vehicle), not isinstance(command, _BESIDE)
    stops = isinstance(command, Disarm) or (isinstance(command, Simple) and command.command != "resume")
    return Order("command", Lane.COMMANDS, steps, writes=True, overrules=overrules, stops=stops, say=say, about=about)


def steps_of(command: OneOff, vehicle: Vehicle) -> list[Step]:
    """At least one, of which the last is never left out."""
    match command:
        case Arm():
            return [_arm(vehicle, always=True)]
        case Disarm():
            forced = FORCE_DISARM if command.force else 0.0
            return [_step("disarming", _long(_M.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, forced))]
        case ChangeMode():
            return [mode_step(vehicle, command.mode)]
        case TakeOff():
            return _take_off(vehicle, command.height_m)
        case GoTo():
            return _go_to(vehicle, command)
        case Simple():
            return [_simple(vehicle, command)]
        case SetHome():
            return [_set_home(vehicle, command)]
        case ChangeSpeed():
            return [_speed(command.m_s)]
        case Turn():
            return [_turn(vehicle, command)]
        case Start():
            return _start(vehicle, command.item)
        case Jump():
            return [_jump(vehicle, command.item)]
        case Orbit():
            return [_orbit(vehicle, command)]
        case LookAt():
            return [_look_at(vehicle, command)]
        case _:
            assert_never(command)


def _step(phase: str, work: CommandWork) -> Step:
    return Step(work, ANSWER_WITHIN_S, phase)


def _long(command: int, *params: float | None) -> CommandWork:
    p1, p2, p3, p4, p5, p6, p7 = [*params, *[0.0] * 7][:7]
    return CommandWork(command, (p1, p2, p3, p4, p5, p6, p7))


def _at(command: int, lat: float, lon: float, alt_m: float, frame: int, *params: float | None) -> CommandWork:
    p1, p2, p3, p4 = [*params, *[0.0] * 4][:4]
    return CommandWork(command, (p1, p2, p3, p4, 0.0, 0.0, alt_m), round(lat * 1e7), round(lon * 1e7), frame)


def _place(vehicle: Vehicle, height_m: float) -> tuple[float, int]:
    """(altitude, frame) as this vehicle reads them."""
    return (vehicle.above_sea(height_m), _ABOVE_SEA) if vehicle.px4 else (height_m, _ABOVE_HOME)


def mode_step(vehicle: Vehicle, name: str, *, skip: bool = False) -> Step:
    """Raises NoSuchMode."""
    main, sub = vehicle.mode(name)
    work = _long(_M.MAV_CMD_DO_SET_MODE, _CUSTOM_MODE, main, sub)
    return Step(work, ANSWER_WITHIN_S, f"changing to {name.upper()}", skip=lambda: skip)


def _arm(vehicle: Vehicle, *, always: bool = False) -> Step:
    work = _long(_M.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    return Step(work, ANSWER_WITHIN_S, "arming", skip=lambda: bool(vehicle.armed) and not always)


def _take_off(vehicle: Vehicle, height_m: float) -> list[Step]:
    phase, is_armed = f"climbing to {height_m:g} m", vehicle.is_armed()
    if vehicle.px4:
        climb = _long(_M.MAV_CMD_NAV_TAKEOFF, None, 0.0, 0.0, None, None, None, vehicle.above_sea(height_m))
        if is_armed:
            return [_step(phase, climb)]
        return [_step("getting ready to climb", climb), Step(_arm(vehicle).work, ANSWER_WITHIN_S, f"arming, {phase}")]
    climb = _long(_M.MAV_CMD_NAV_TAKEOFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, height_m)
    return [mode_step(vehicle, "GUIDED", skip=vehicle.is_in("GUIDED")), _arm(vehicle), _step(phase, climb)]


def _go_to(vehicle: Vehicle, wish: GoTo) -> list[Step]:
    alt_m, frame = _place(vehicle, wish.height_m)
    speed = _AS_IT_IS if wish.speed_m_s is None else wish.speed_m_s
    go = _at(_M.MAV_CMD_DO_REPOSITION, wish.lat, wish.lon, alt_m, frame, speed, _CHANGE_MODE, 0.0, None)
    steps = [_step(f"flying to {wish.lat:.6f}, {wish.lon:.6f} at {wish.height_m:g} m", go)]
    if wish.speed_m_s is not None and not vehicle.px4:  # a Copter does not look at the speed in it
        steps.append(_speed(wish.speed_m_s))
    return steps


def _simple(vehicle: Vehicle, wish: Simple) -> Step:
    names = {"land": _LAND, "rtl": _RETURN, "hold": _HOLD}.get(wish.command)
    if names is not None:
        return mode_step(vehicle, names[vehicle.px4])
    pauses = wish.command == "pause"
    if vehicle.px4:
        return mode_step(vehicle, (_HOLD if pauses else _MISSION)[True])
    if pauses or vehicle.is_in("AUTO") or vehicle.is_in("GUIDED"):
        phase = "pausing" if pauses else "going on"
        return _step(phase, _long(_M.MAV_CMD_DO_PAUSE_CONTINUE, 0.0 if pauses else 1.0))
    return mode_step(vehicle, _MISSION[False])


def _set_home(vehicle: Vehicle, wish: SetHome) -> Step:
    lat, lon, altitude_m = wish.lat, wish.lon, wish.altitude_m
    if lat is None or lon is None or altitude_m is None:
        if vehicle.airborne is False:
            return _step("making this place home", _long(_M.MAV_CMD_DO_SET_HOME, 1.0))
        # An autopilot would lift home to where it is, and every height above home would jump.
        (lat, lon), altitude_m = vehicle.place(), vehicle.above_sea(0.0)
    work = _at(_M.MAV_CMD_DO_SET_HOME, lat, lon, altitude_m, _ABOVE_SEA)
    return _step(f"making {lat:.6f}, {lon:.6f} home", work)


def _speed(m_s: float) -> Step:
    return _step(f"flying at {m_s:g} m/s", _long(_M.MAV_CMD_DO_CHANGE_SPEED, _GROUND_SPEED, m_s, _AS_IT_IS))


def _turn(vehicle: Vehicle, wish: Turn) -> Step:
    if vehicle.px4:
        raise NotKnownHow(f"{vehicle.name} flies PX4, which turns on command in missions only: use `roi` or `goto`")
    deg = wish.deg if wish.relative else wish.deg % 360.0
    direction = (-1.0 if deg < 0 else 1.0) if wish.relative else 0.0
    work = _long(_M.MAV_CMD_CONDITION_YAW, abs(deg), 0.0, direction, 1.0 if wish.relative else 0.0)
    return _step(f"turning {'by' if wish.relative else 'to'} {deg:g}\u00b0", work)


def _check_item(vehicle: Vehicle, item: int) -> None:
    if vehicle.mission_items is not None and item >= vehicle.mission_items:
        count = vehicle.mission_items
        there = f"the mission on board has {count} items" if count else "no mission is on board"
        raise NoSuchItem(f"{vehicle.name} has no item {item + 1}: {there}")


def _set_item(vehicle: Vehicle, item: int, *, anew: bool) -> Step:
    """Of an ArduPilot. `anew`: counted jumps begin anew."""
    work = _long(_M.MAV_CMD_DO_SET_MISSION_CURRENT, item + 1.0, 1.0 if anew else 0.0)
    return _step(f"going to item {item + 1}", work)


def _start(vehicle: Vehicle, item: int) -> list[Step]:
    _check_item(vehicle, item)
    phase, is_armed = f"flying the mission from item {item + 1}", vehicle.is_armed()
    if vehicle.px4:  # arms for it
        return [_step(phase, _long(_M.MAV_CMD_MISSION_START, float(item)))]
    ready = [] if is_armed else [mode_step(vehicle, "GUIDED", skip=vehicle.is_in("GUIDED")), _arm(vehicle)]
    return [*ready, _set_item(vehicle, item, anew=True), _step(phase, _long(_M.MAV_CMD_MISSION_START))]


def _jump(vehicle: Vehicle, item: int) -> Step:
    _check_item(vehicle, item)
    if not vehicle.px4:
        return _set_item(vehicle, item, anew=False)
    if not vehicle.is_in("AUTO.MISSION") or not vehicle.armed:
        raise NotKnownHow(f"{vehicle.name} flies PX4, which jumps only while it flies a mission: use `start` with item")
    return _step(f"going to item {item + 1}", _long(_M.MAV_CMD_MISSION_START, float(item)))


def _orbit(vehicle: Vehicle, wish: Orbit) -> Step:
    if not vehicle.px4:
        raise NotKnownHow(f"{vehicle.name} flies ArduCopter, which circles a place in missions only: plan it")
    alt_m, frame = _place(vehicle, wish.height_m)
    work = _at(_M.MAV_CMD_DO_ORBIT, wish.lat, wish.lon, alt_m, frame, wish.radius_m, wish.m_s, 0.0, None)
    return _step(f"circling at {abs(wish.radius_m):g} m", work)


def _look_at(vehicle: Vehicle, wish: LookAt) -> Step:
    if wish.lat is None or wish.lon is None or wish.height_m is None:
        return _step("looking ahead again", _long(_M.MAV_CMD_DO_SET_ROI_NONE))
    alt_m, frame = _place(vehicle, wish.height_m)
    work = _at(_M.MAV_CMD_DO_SET_ROI_LOCATION, wish.lat, wish.lon, alt_m, frame)
    return _step(f"looking at {wish.lat:.6f}, {wish.lon:.6f}", work)
