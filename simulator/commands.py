"""COMMAND_LONG and COMMAND_INT: what each command does, and how ArduCopter answers it.

Commands are not filtered by who sends them (sticks are). The answer is sent by the vehicle, in any case before
what the command causes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from simulator import commands_flight as fly
from simulator.commands_camera import CAMERA_HANDLERS
from simulator.dialect import Message, mavlink
from simulator.fence_rules import enable_fence
from simulator.flight import Flight
from simulator.geodesy import clamp
from simulator.modes import Mode

ACCEPTED = int(mavlink.MAV_RESULT_ACCEPTED)
TEMPORARILY_REJECTED = int(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
DENIED = int(mavlink.MAV_RESULT_DENIED)
UNSUPPORTED = int(mavlink.MAV_RESULT_UNSUPPORTED)
FAILED = int(mavlink.MAV_RESULT_FAILED)

ALT_MAX_M = 50_000.0


@dataclass(frozen=True, slots=True)
class Command:
    """Both messages in one shape. What was not a finite number has become 0."""

    number: int
    params: tuple[float, float, float, float]
    lat_e7: int
    lon_e7: int
    alt_m: float
    frame: int
    raw: tuple[float, ...]
    """The seven parameters of a COMMAND_LONG as they came; of a COMMAND_INT only the first four."""
    alt_is_given: bool = True
    """Not NaN, which some autopilots read as "as it is"."""

    @property
    def is_long(self) -> bool:
        return len(self.raw) == 7

    @property
    def place_is_valid(self) -> bool:
        return (
            abs(self.lat_e7) <= 900_000_000
            and abs(self.lon_e7) <= 1_800_000_000
            and (self.lat_e7 != 0 or self.lon_e7 != 0)
        )


def read_command(message: Message) -> Command:
    params = (message.param1, message.param2, message.param3, message.param4)
    first = tuple(_finite(value) for value in params)
    four = (first[0], first[1], first[2], first[3])
    if message.get_type() == "COMMAND_INT":
        return Command(
            message.command,
            four,
            message.x,
            message.y,
            _altitude(message.z),
            message.frame,
            four,
            math.isfinite(message.z),
        )
    seven = (*four, *(_finite(v) for v in (message.param5, message.param6, message.param7)))
    lat_e7, lon_e7 = (round(v * 1e7) if abs(v) <= 360.0 else 2**31 - 1 for v in seven[4:6])
    relative = int(mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT)
    return Command(
        message.command, four, lat_e7, lon_e7, _altitude(seven[6]), relative, seven, math.isfinite(message.param7)
    )


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _altitude(value: float) -> float:
    """Kept where it can be computed with and told in millimetres."""
    return clamp(_finite(value), -ALT_MAX_M, ALT_MAX_M)


Handler = Callable[[Flight, Command], int]


def carry_out(flight: Flight, command: Command) -> int:
    """The MAV_RESULT. Commands that need more than the flight code are handled before this is called."""
    handler = flight.flavour.handlers.get(command.number)
    return handler(flight, command) if handler is not None else UNSUPPORTED


def result(done: bool) -> int:
    return ACCEPTED if done else FAILED


HANDLERS: dict[int, Handler] = {
    **CAMERA_HANDLERS,
    int(mavlink.MAV_CMD_DO_SET_MODE): fly.set_mode,
    int(mavlink.MAV_CMD_COMPONENT_ARM_DISARM): fly.arm_or_disarm,
    int(mavlink.MAV_CMD_NAV_TAKEOFF): fly.take_off,
    int(mavlink.MAV_CMD_NAV_LAND): lambda f, _: result(f.set_mode(Mode.LAND)),
    int(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH): lambda f, _: result(f.set_mode(Mode.RTL)),
    int(mavlink.MAV_CMD_NAV_LOITER_UNLIM): lambda f, _: result(f.set_mode(Mode.LOITER)),
    int(mavlink.MAV_CMD_DO_REPOSITION): fly.reposition,
    int(mavlink.MAV_CMD_DO_CHANGE_SPEED): fly.change_speed,
    int(mavlink.MAV_CMD_CONDITION_YAW): fly.turn,
    int(mavlink.MAV_CMD_DO_PAUSE_CONTINUE): fly.pause_or_continue,
    int(mavlink.MAV_CMD_DO_SET_HOME): fly.set_home,
    int(mavlink.MAV_CMD_MISSION_START): fly.start_mission,
    int(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT): fly.set_current_item,
    int(mavlink.MAV_CMD_DO_FLIGHTTERMINATION): fly.terminate,
    int(mavlink.MAV_CMD_DO_FENCE_ENABLE): enable_fence,
    int(mavlink.MAV_CMD_RUN_PREARM_CHECKS): fly.run_checks,
    int(mavlink.MAV_CMD_PREFLIGHT_CALIBRATION): lambda f, _: FAILED if f.armed else ACCEPTED,
}
