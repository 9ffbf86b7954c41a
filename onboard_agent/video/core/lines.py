"""Messages between flight process and video process: lines of JSON on the child's stdin and stdout. No I/O.
Both have the same version; a process that reads an invalid line gives up the other."""

from typing import Final

import msgspec

from onboard_agent.video.core.link_memory import Remembered
from wire.video import CameraState, Codec, StreamRequest

MAX_LINE_BYTES: Final = 16 * 1024
REPORT_EVERY_S: Final = 0.2
"""The child reports each change, and at this interval in any case, to show that it is alive (`child_watch`)."""


class BadLine(ValueError):
    """The line is not a valid message."""


class SetUp(msgspec.Struct, frozen=True, tag="set_up", tag_field="type", kw_only=True):
    """First message to the child, once. Not an argument, because a camera's address may contain a password."""

    tower: str
    camera: str
    uplinks: tuple[str, ...]
    log_level: str = "info"
    link: Remembered | None = None
    """The latest report of the previous child."""
    trial: bool = False
    """Only open the camera; do not connect to the tower."""


class Watched(msgspec.Struct, frozen=True, tag="watched", tag_field="type", kw_only=True):
    """To the child, on each change: the streams to make, and the ticket for the tower. No streams: idle. `tower`: whose
    ticket it is, if another tower has the link than that of SetUp."""

    ticket: str = ""
    tower: str = ""
    streams: tuple[StreamRequest, ...] = ()
    frames: str = ""
    """Path of the shared memory for the newest picture (`video.frame_share`); empty: nobody looks."""


class Report(msgspec.Struct, frozen=True, tag="report", tag_field="type", kw_only=True):
    """From the child. Fields as in wire.video.VideoState."""

    camera: CameraState
    words: str = ""
    thin: bool = False
    codecs: tuple[Codec, ...] = ()
    """Empty: not known yet."""
    link: Remembered | None = None
    """For the next child, if this one ends."""


_to_child: Final[msgspec.json.Decoder[SetUp | Watched]] = msgspec.json.Decoder(SetUp | Watched)
_from_child: Final[msgspec.json.Decoder[Report]] = msgspec.json.Decoder(Report)
_encoder: Final = msgspec.json.Encoder()


def encode_line(message: SetUp | Watched | Report) -> bytes:
    """Includes the newline."""
    return _encoder.encode(message) + b"\n"


def decode_to_child(line: bytes) -> SetUp | Watched:
    """Raises BadLine."""
    try:
        return _to_child.decode(line)
    except msgspec.DecodeError as error:
        raise BadLine(str(error)) from None


def decode_from_child(line: bytes) -> Report:
    """Raises BadLine."""
    try:
        return _from_child.decode(line)
    except msgspec.DecodeError as error:
        raise BadLine(str(error)) from None
