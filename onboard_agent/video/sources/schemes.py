"""The table of camera types, from which parser and help text are made. Loads no picture library, so that the flight
process can check a setting."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple
from urllib.parse import parse_qsl, urlsplit

from onboard_agent.unusable import Unusable
from onboard_agent.video.sources.mode import Mode
from onboard_agent.video.sources.picture_size import TooLarge, check_size
from onboard_agent.video.sources.realsense_streams import STREAM_FORM, read_realsense, wrong_realsense

if TYPE_CHECKING:
    from onboard_agent.video.sources.source import Source


class CameraSpec(NamedTuple):
    """`what`: device, file, number or address. `name`: the whole text without a password."""

    scheme: str
    what: str
    mode: Mode
    name: str


@dataclass(frozen=True)
class Scheme:
    """One type of camera: its syntax, its description, whether a mode may follow, a check of the part after the scheme,
    and its factory."""

    form: str
    meaning: str
    has_mode: bool
    wrong_with: Callable[[str], str]
    make: Callable[[CameraSpec], Source]


_HIDDEN: Final = "..."
_MODE_LIMITS: Final = {"width": 8192, "height": 8192, "rate": 240}


def _device(spec: CameraSpec) -> Source:
    from onboard_agent.video.sources.v4l2 import V4l2Source

    return V4l2Source(spec.name, spec.what, spec.mode)


def _pi(spec: CameraSpec) -> Source:
    from onboard_agent.video.sources.pi import PiSource

    return PiSource(spec.name, int(spec.what), spec.mode)


def _realsense(spec: CameraSpec) -> Source:
    from onboard_agent.video.sources.realsense import RealsenseSource

    found = read_realsense(spec.what)
    assert found is not None
    return RealsenseSource(spec.name, *found, spec.mode)


def _file(spec: CameraSpec) -> Source:
    from onboard_agent.video.sources.looped_file import LoopedFile

    return LoopedFile(spec.name, Path(spec.what))


def _network(spec: CameraSpec) -> Source:
    from onboard_agent.video.sources.network import NetworkSource

    return NetworkSource(spec.name, spec.what)


def _http(spec: CameraSpec) -> Source:
    from onboard_agent.video.sources.http_camera import HttpCamera

    return HttpCamera(spec.name, spec.what)


def _not_empty(what: str) -> Callable[[str], str]:
    return lambda rest: "" if rest else f"expected {what} after the scheme"


def _wrong_number(rest: str) -> str:
    return "" if rest.isascii() and rest.isdecimal() and len(rest) <= 2 else "expected the camera's number (0)"


def _wrong_address(address: str) -> str:
    if not (address.isascii() and address.isprintable()) or " " in address:
        return "what is no letter, digit or mark of ASCII is to be written as %20 and so on"
    try:
        parts = urlsplit(address)
        found = bool(parts.hostname) and parts.port != 0
    except ValueError:  # its text may contain a part of a password
        found = False
    return "" if found else "expected //HOST[:PORT]/PATH after the scheme (in a password, / is %2F, ? is %3F, # is %23)"


_SIZE: Final = "[?width=W&height=H&rate=R]"

SCHEMES: Final[dict[str, Scheme]] = {
    "v4l2": Scheme(f"v4l2:DEVICE{_SIZE}", "a USB or built-in camera", True, _not_empty("/dev/video0 or so"), _device),
    "pi": Scheme(f"pi:NUMBER{_SIZE}", "a Raspberry Pi camera, by rpicam-vid", True, _wrong_number, _pi),
    "realsense": Scheme(
        f"realsense:{STREAM_FORM}{_SIZE}", "a stream of a RealSense camera", True, wrong_realsense, _realsense
    ),
    "file": Scheme("file:PATH", "a video file, over and over", False, _not_empty("a path"), _file),
    "rtsp": Scheme("rtsp://...", "a camera in the network", False, _wrong_address, _network),
    "http": Scheme("http://...", "MJPEG, or whatever else FFmpeg opens", False, _wrong_address, _http),
    "https": Scheme("https://...", "the same, encrypted", False, _wrong_address, _http),
}

FORMS: Final = " | ".join(scheme.form for scheme in SCHEMES.values())


def help_text() -> str:
    """One sentence for each type."""
    return "; ".join(f"{scheme.form}: {scheme.meaning}" for scheme in SCHEMES.values())


def shown(text: str) -> str:
    """Formats a camera setting for users and logs. In addresses it hides possible secrets: everything before the last
    `@`, since a password may contain `/` or `?`, and values, since many cameras take the password as one."""
    whole = text.strip()
    scheme, is_address, rest = whole.partition("://")
    if not is_address:
        kind = whole.partition(":")[0]
        return whole if "@" not in whole or kind in ("file", "v4l2") else f"{kind}:{_HIDDEN}"
    _, is_somebody, rest = rest.rpartition("@")
    place = re.split("[?#]", rest, maxsplit=1)[0]
    host, slash, path = (_HIDDEN if re.search("[=&]", part) else part for part in place.partition("/"))
    return (
        f"{scheme}://{_HIDDEN + '@' if is_somebody else ''}{host}{slash}{path}{'?' + _HIDDEN if place != rest else ''}"
    )


def parse_spec(text: str) -> CameraSpec:
    """Opens no camera. Raises Unusable."""
    whole = text.strip()
    name = shown(whole)
    scheme, _, rest = whole.partition(":")
    found = SCHEMES.get(scheme)
    if found is None:
        raise Unusable(f"the camera {name!r} is of no known kind; known: {FORMS}")
    what, mode = rest, Mode()
    if found.has_mode:
        what, _, query = rest.partition("?")
        mode = _mode(name, query)
    elif found.wrong_with is _wrong_address:
        what = whole
    wrong = found.wrong_with(what)
    if wrong:
        raise Unusable(f"{name}: {wrong}")
    return CameraSpec(scheme, what, mode, name)


def check_spec(text: str) -> None:
    """Raises Unusable if `text` names no camera. Opens and loads nothing."""
    parse_spec(text)


def make_source(text: str) -> Source:
    """Returns the source that `text` names, not yet opened. Raises Unusable."""
    spec = parse_spec(text)
    return SCHEMES[spec.scheme].make(spec)


def _mode(name: str, query: str) -> Mode:
    given: dict[str, int] = {}
    try:
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
    except ValueError:
        raise Unusable(f"{name}: expected {_SIZE} at the end") from None
    for key, value in pairs:
        most = _MODE_LIMITS.get(key)
        if most is None:
            raise Unusable(f"{name}: {key!r} is not known; known: {', '.join(_MODE_LIMITS)}")
        if not (value.isascii() and value.isdecimal() and len(value) <= 5 and 1 <= int(value) <= most):
            raise Unusable(f"{name}: {key} is to be a whole number from 1 to {most}")
        given[key] = int(value)
    if ("width" in given) != ("height" in given):
        raise Unusable(f"{name}: width and height go together")
    mode = Mode(given.get("width", 0), given.get("height", 0), given.get("rate", 0))
    try:
        check_size(mode.width, mode.height)
    except TooLarge as error:
        raise Unusable(f"{name}: {error}") from None
    return mode
