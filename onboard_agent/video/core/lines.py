"""The protocol between flight process and video process: lines of JSON on the child's stdin and stdout. No I/O.

Both are of one version; a side that reads an invalid line gives the other up.
"""

from typing import Final

import msgspec

from onboard_agent.video.core.link_memory import Remembered
from wire.video import CameraState, Codec, StreamRequest

MAX_LINE_BYTES: Final = 16 * 1024
REPORT_EVERY_S: Final = 0.2
"""The child reports on each change, and so often in any case: it is alive (`child_watch`)."""


class BadLine(ValueError):
    """Not one of these."""


class SetUp(msgspec.Struct, frozen=True, tag="set_up", tag_field="type", kw_only=True):
    """To the child, first and once. In no argument, since a camera's address may have a password in it."""

    tower: str
    camera: str
    uplinks: tuple[str, ...]
    log_level: str = "info"
    link: Remembered | None = None
    """What the last child reported."""
    trial: bool = False
    """Only the camera is opened; the tower is left alone."""


class Watched(msgspec.Struct, frozen=True, tag="watched", tag_field="type", kw_only=True):
    """To the child, on each change: which streams to make, and the ticket that opens the tower. None: rest."""

    ticket: str = ""
    streams: tuple[StreamRequest, ...] = ()


class Report(msgspec.Struct, frozen=True, tag="report", tag_field="type", kw_only=True):
    """From the child. As in wire.video.VideoState."""

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
    """With the end of the line."""
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
