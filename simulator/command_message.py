"""COMMAND_LONG and COMMAND_INT as one type, and the results in their acknowledgements."""

from __future__ import annotations

import math
from dataclasses import dataclass

from simulator.dialect import Message, mavlink
from simulator.geodesy import clamp

ACCEPTED = int(mavlink.MAV_RESULT_ACCEPTED)
TEMPORARILY_REJECTED = int(mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
DENIED = int(mavlink.MAV_RESULT_DENIED)
UNSUPPORTED = int(mavlink.MAV_RESULT_UNSUPPORTED)
FAILED = int(mavlink.MAV_RESULT_FAILED)

ALT_MAX_M = 50_000.0


@dataclass(frozen=True, slots=True)
class Command:
    """Both messages as one type. Values that are not finite are 0."""

    number: int
    params: tuple[float, float, float, float]
    lat_e7: int
    lon_e7: int
    alt_m: float
    frame: int
    raw: tuple[float, ...]
    """The seven parameters of a COMMAND_LONG as received; of a COMMAND_INT only the first four."""
    given: tuple[float, ...] = ()
    """`raw` with what is not finite, which some commands read as "unchanged"."""
    alt_is_given: bool = True
    """Not NaN, which some autopilots read as "unchanged"."""

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
            params,
            math.isfinite(message.z),
        )
    seven = (*four, *(_finite(v) for v in (message.param5, message.param6, message.param7)))
    lat_e7, lon_e7 = (round(v * 1e7) if abs(v) <= 360.0 else 2**31 - 1 for v in seven[4:6])
    relative = int(mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT)
    given = (*params, message.param5, message.param6, message.param7)
    altitude_m, has_altitude = _altitude(seven[6]), math.isfinite(message.param7)
    return Command(message.command, four, lat_e7, lon_e7, altitude_m, relative, seven, given, has_altitude)


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _altitude(value: float) -> float:
    """Clamps the altitude to a range for computation and for millimetres."""
    return clamp(_finite(value), -ALT_MAX_M, ALT_MAX_M)
