"""The lines between the flight process and a controller's process: one JSON object each. Pure."""

from enum import StrEnum
from typing import Annotated, Final

import msgspec

from onboard_agent.autonomy.core.directions import Direction

MAX_LINE_BYTES: Final = 16_384
_Words = Annotated[str, msgspec.Meta(max_length=400)]


class DirectionState(StrEnum):
    """What has become of a direction."""

    FLYING = "flying"
    DONE = "done"
    REFUSED = "refused"
    EXPIRED = "expired"
    """It was not done within its time; the drone holds."""


class SetUp(msgspec.Struct, frozen=True, tag="set_up", tag_field="line"):
    """The first line to the process. `source`: FILE:CLASS; empty for one that is built in or installed."""

    name: str
    source: str = ""
    max_speed_m_s: float = 5.0
    min_height_m: float = 2.0
    max_height_m: float = 30.0
    max_distance_m: float = 100.0
    may_take_off: bool = False


class Seen(msgspec.Struct, frozen=True, tag="seen", tag_field="line"):
    """Telemetry, ten times a second, and the acknowledgement of the newest direction.

    `at_s`: the agent's monotonic clock. Velocities north, east and up. `number`: of the newest judged direction, from
    1; 0: none. `bounded`: its speed was reduced to the limits.
    """

    at_s: float
    lat_deg: float
    lon_deg: float
    height_m: float
    north_m_s: float
    east_m_s: float
    up_m_s: float
    heading_deg: float
    armed: bool
    airborne: bool
    number: int = 0
    state: DirectionState = DirectionState.DONE
    words: str = ""
    bounded: bool = False


class Ready(msgspec.Struct, frozen=True, tag="ready", tag_field="line"):
    """The controller is loaded."""


class Beat(msgspec.Struct, frozen=True, tag="beat", tag_field="line"):
    """The controller lives, and has no new direction."""


class Directed(msgspec.Struct, frozen=True, tag="directed", tag_field="line"):
    """A new direction replaces the one before. `number` counts them, from 1."""

    number: Annotated[int, msgspec.Meta(ge=1)]
    direction: Direction


class Raised(msgspec.Struct, frozen=True, tag="raised", tag_field="line"):
    """The controller cannot be loaded, or has raised an exception."""

    words: _Words


class Gone(msgspec.Struct, frozen=True, tag="gone", tag_field="line"):
    """The process has ended, or says what cannot be understood. Made by the agent itself."""

    words: _Words


FromController = Ready | Beat | Directed | Raised
Report = FromController | Gone
ToController = SetUp | Seen

_from = msgspec.json.Decoder(FromController)
_to = msgspec.json.Decoder(ToController)


def encode_line(line: ToController | FromController) -> bytes:
    """Returns the line with its end."""
    return msgspec.json.encode(line) + b"\n"


def decode_from_controller(line: bytes) -> FromController:
    """Raises msgspec.DecodeError (msgspec.ValidationError among them)."""
    report: FromController = _from.decode(line)
    return report


def decode_to_controller(line: bytes) -> ToController:
    """Raises msgspec.DecodeError."""
    told: ToController = _to.decode(line)
    return told
