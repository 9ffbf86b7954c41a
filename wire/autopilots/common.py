"""Commands that ArduPilot and PX4 share, and building blocks for the others. Pure."""

from __future__ import annotations

from math import pi, radians
from typing import Final

from wire.autopilots.commands import (
    FORCE_DISARM,
    Arm,
    ChangeSpeed,
    CommandStep,
    Disarm,
    GoTo,
    LookAt,
    SetHome,
    Steps,
    VehicleState,
)
from wire.autopilots.profile import AutopilotFamily
from wire.dialect import mavlink
from wire.transactions import CommandWork

_M: Final = mavlink
GROUND_SPEED: Final = 1.0
AS_IT_IS: Final = -1.0
CHANGE_MODE: Final = 1.0
"""param2 of DO_REPOSITION: enter the mode that flies there."""
ABOVE_SEA: Final = int(_M.MAV_FRAME_GLOBAL)
ABOVE_HOME: Final = int(_M.MAV_FRAME_GLOBAL_RELATIVE_ALT)


def command_long(command: int, *params: float | None) -> CommandWork:
    """Parameters left out are 0; None is NaN."""
    p1, p2, p3, p4, p5, p6, p7 = [*params, *[0.0] * 7][:7]
    return CommandWork(int(command), (p1, p2, p3, p4, p5, p6, p7))


def command_at(
    command: int, place_deg: tuple[float, float], altitude: tuple[float, int], *params: float | None
) -> CommandWork:
    """Builds a COMMAND_INT. `altitude`: metres, and their frame."""
    p1, p2, p3, p4 = [*params, *[0.0] * 4][:4]
    (lat, lon), (alt_m, frame) = place_deg, altitude
    return CommandWork(int(command), (p1, p2, p3, p4, 0.0, 0.0, alt_m), round(lat * 1e7), round(lon * 1e7), frame)


def altitude_for(family: AutopilotFamily, state: VehicleState, height_m: float) -> tuple[float, int]:
    """Returns (altitude, frame) of a height above home as this family reads them. Raises NotHeardYet."""
    return (height_m, ABOVE_HOME) if family.reads_frames else (state.above_sea(height_m), ABOVE_SEA)


def yaw_rad(heading_deg: float | None) -> float | None:
    """Returns -pi to pi, as DO_REPOSITION expects; None: NaN, the autopilot's own rule."""
    return None if heading_deg is None else (radians(heading_deg) + pi) % (2 * pi) - pi


def arm(state: VehicleState, command: Arm) -> Steps:
    """Sent to an armed drone too: the autopilot itself reports that it is armed."""
    return (arming(),)


def arming(*, needless: bool = False, phase: str = "arming") -> CommandStep:
    """Returns the step that arms."""
    return CommandStep(phase, command_long(_M.MAV_CMD_COMPONENT_ARM_DISARM, 1.0), needless)


def disarm(state: VehicleState, command: Disarm) -> Steps:
    """Both autopilots refuse it in the air, unless forced."""
    forced = FORCE_DISARM if command.force else 0.0
    return (CommandStep("disarming", command_long(_M.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, forced)),)


def change_speed(state: VehicleState, command: ChangeSpeed) -> Steps:
    """Ground speed."""
    return (speed_step(command.m_s),)


def speed_step(m_s: float) -> CommandStep:
    """Returns the step that sets the ground speed."""
    work = command_long(_M.MAV_CMD_DO_CHANGE_SPEED, GROUND_SPEED, m_s, AS_IT_IS)
    return CommandStep(f"flying at {m_s:g} m/s", work)


def reposition(family: AutopilotFamily, state: VehicleState, command: GoTo) -> CommandStep:
    """Returns the step that flies to a position."""
    speed = AS_IT_IS if command.speed_m_s is None else command.speed_m_s
    place_deg = (command.lat_deg, command.lon_deg)
    altitude = altitude_for(family, state, command.height_m)
    params = (speed, CHANGE_MODE, 0.0, yaw_rad(command.heading_deg))
    work = command_at(_M.MAV_CMD_DO_REPOSITION, place_deg, altitude, *params)
    return CommandStep(f"flying to {command.lat_deg:.6f}, {command.lon_deg:.6f} at {command.height_m:g} m", work)


def set_home(state: VehicleState, command: SetHome) -> Steps:
    """Keeps the altitude of home unless the drone is known to be on the ground: an autopilot would raise home to the
    drone's altitude, and every height above home would jump."""
    if command.place_deg is None and state.airborne is False:
        return (CommandStep("making this place home", command_long(_M.MAV_CMD_DO_SET_HOME, 1.0)),)
    lat, lon = state.here() if command.place_deg is None else command.place_deg
    altitude_m = state.above_sea(0.0) if command.altitude_m is None else command.altitude_m
    work = command_at(_M.MAV_CMD_DO_SET_HOME, (lat, lon), (altitude_m, ABOVE_SEA))
    return (CommandStep(f"making {lat:.6f}, {lon:.6f} home", work),)


def look_at(family: AutopilotFamily, state: VehicleState, command: LookAt) -> Steps:
    """Points the camera at a position, or ahead again."""
    if command.place is None:
        return (CommandStep("looking ahead again", command_long(_M.MAV_CMD_DO_SET_ROI_NONE)),)
    lat, lon, height_m = command.place
    work = command_at(_M.MAV_CMD_DO_SET_ROI_LOCATION, (lat, lon), altitude_for(family, state, height_m))
    return (CommandStep(f"looking at {lat:.6f}, {lon:.6f}", work),)
