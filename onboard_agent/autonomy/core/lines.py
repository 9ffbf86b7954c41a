"""The lines between the flight process and a controller's process: one JSON object each. Pure."""

from enum import StrEnum
from typing import Annotated, Final

import msgspec

from onboard_agent.autonomy.core.directions import Direction

MAX_LINE_BYTES: Final = 16_384
MAX_THUMBNAIL_BYTES: Final = 8_000
MAX_WAYPOINTS: Final = 80
VIDEO: Final = "video"
"""The source of a camera that is the video process's own."""
_Words = Annotated[str, msgspec.Meta(max_length=400)]


class DirectionState(StrEnum):
    """What has become of a direction."""

    FLYING = "flying"
    DONE = "done"
    REFUSED = "refused"
    EXPIRED = "expired"
    """It was not done within its time; the drone holds."""


class CameraKind(StrEnum):
    """What a camera's pixels mean."""

    COLOUR = "colour"
    INFRARED = "infrared"
    DEPTH = "depth"


class CameraSetting(msgspec.Struct, frozen=True):
    """One camera for controllers. `source`: as `camera` in agent.toml, or VIDEO. `tilt_deg`: of its axis, down from
    forward; `up_m`: the lens above the place that the autopilot calls its own."""

    name: str
    source: str
    kind: CameraKind = CameraKind.COLOUR
    tilt_deg: float = 90.0
    field_of_view_deg: float = 75.0
    up_m: float = 0.0


class Waypoint(msgspec.Struct, frozen=True):
    """Of the mission on board. `height_m`: above home; None where the mission says it in another way."""

    lat_deg: float
    lon_deg: float
    height_m: float | None = None


class SetUp(msgspec.Struct, frozen=True, tag="set_up", tag_field="line"):
    """The first line to the process. `source`: FILE:CLASS; empty for one that is built in or installed."""

    name: str
    source: str = ""
    max_speed_m_s: float = 5.0
    min_height_m: float = 2.0
    max_height_m: float = 30.0
    max_distance_m: float = 100.0
    may_take_off: bool = False
    settings: dict[str, str | float] = {}
    """Of the request that starts it."""
    cameras: tuple[CameraSetting, ...] = ()
    mission: tuple[Waypoint, ...] = ()
    """The mission on board when it starts, its first MAX_WAYPOINTS places."""
    frames_path: str = ""
    """Shared memory with the newest picture of the video process; empty: there is none."""


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
    position_at_s: float = 0.0
    """When the position came, on the clock of `at_s`."""
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    attitude_at_s: float = 0.0
    """0: the autopilot reports no attitude."""


class Ready(msgspec.Struct, frozen=True, tag="ready", tag_field="line"):
    """The controller is loaded."""


class Beat(msgspec.Struct, frozen=True, tag="beat", tag_field="line"):
    """The controller lives, and has no new direction. `pictures`: how many it has taken so far."""

    pictures: int = 0


class Note(msgspec.Struct, frozen=True, tag="note", tag_field="line"):
    """What the controller does, for people. `aloud`: as STATUSTEXT too."""

    words: _Words
    aloud: bool = False


class VideoBox(msgspec.Struct, frozen=True):
    """Where the picture of the live video that was taken at `taken_s` shows a target: the middle of its box and the
    box's size, as shares of the picture's width and height, from the upper left."""

    x: float
    y: float
    width: float
    height: float
    taken_s: float


class Found(msgspec.Struct, frozen=True, tag="found", tag_field="line"):
    """A target and its place on the map. `confidence`: 0 to 1. `thumbnail`: a JPEG, or empty. `in_video`: only if the
    camera is the one of the live video. `sighting`: it is in view at this moment, for the eye alone."""

    letter: Annotated[str, msgspec.Meta(max_length=8)]
    confidence: float
    lat_deg: float
    lon_deg: float
    thumbnail: Annotated[bytes, msgspec.Meta(max_length=MAX_THUMBNAIL_BYTES)] = b""
    in_video: VideoBox | None = None
    sighting: bool = False


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


FromController = Ready | Beat | Note | Found | Directed | Raised
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
