"""The setting of a RealSense camera: which stream of which device. Loads no library."""

import re
from enum import StrEnum
from typing import Final, NamedTuple


class Stream(StrEnum):
    """What one device gives. `ALIGNED`: depth in the pixels of the colour picture."""

    COLOUR = "colour"
    INFRARED = "infrared"
    INFRARED_RIGHT = "infrared2"
    DEPTH = "depth"
    ALIGNED = "aligned"


STREAM_FORM: Final = "STREAM[:SERIAL|:FILE]"
_WHAT: Final = re.compile(rf"({'|'.join(Stream)})(?::(?:([0-9]{{1,20}})|(.+\.(?:db3|bag))))?")


class Where(NamedTuple):
    """A device by its serial number (empty: the first one), or a recording."""

    serial: str = ""
    recording: str = ""


def read_realsense(what: str) -> tuple[Stream, Where] | None:
    """Reads the part after `realsense:`; None: it is no such setting."""
    match = _WHAT.fullmatch(what)
    if match is None:
        return None
    return Stream(match[1]), Where(match[2] or "", match[3] or "")


def wrong_realsense(what: str) -> str:
    """Returns what is wrong, in words; empty if nothing is."""
    if read_realsense(what) is not None:
        return ""
    return f"expected {STREAM_FORM} after the scheme: {', '.join(Stream)}; digits, or a recording (.db3, .bag)"
