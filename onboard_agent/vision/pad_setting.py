"""The setting of a landing pad: its markers, and the camera that looks for it. Pure; loads no picture library."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final
from urllib.parse import parse_qsl

from onboard_agent.unusable import Unusable

FORM: Final = "FAMILY:NUMBER=SIDE[@RIGHT,UP][;NUMBER=...]"
CAMERA_FORM: Final = "camera source, with #tilt=90&fov=75&turn=0&spin=0&forward=0&right=0&down=0"
_CAMERA_KEYS: Final = ("tilt", "fov", "turn", "spin", "forward", "right", "down")
MAX_MARKERS: Final = 16
MAX_SIDE_M: Final = 10.0


@dataclass(frozen=True, slots=True)
class PadMarker:
    """`side_m`: of the black square. `right_m`, `up_m`: its centre from the place to touch down, in its own axes."""

    number: int
    side_m: float
    right_m: float = 0.0
    up_m: float = 0.0


@dataclass(frozen=True, slots=True)
class PadSetting:
    """`family`: as in `markers.FAMILIES`. `source`: of the pictures. `camera`: what the keys of CAMERA_FORM say, in
    degrees and metres."""

    family: str
    markers: tuple[PadMarker, ...]
    source: str
    camera: tuple[tuple[str, float], ...] = ()


def parse_pad_setting(pad: str, camera: str) -> PadSetting:
    """`pad`: `aruco-4x4-50:0=1.0@0,0.85;1=0.16`. Raises Unusable."""
    family, _, rest = pad.partition(":")
    markers = tuple(_marker(text, pad) for text in rest.split(";") if text.strip())
    numbers = {marker.number for marker in markers}
    if not family or not markers or len(numbers) < len(markers) or len(markers) > MAX_MARKERS:
        raise Unusable(f"landing_pad: {pad!r} must have the form {FORM}, each number once")
    source, _, said = camera.partition("#")
    if not source:
        raise Unusable(f"landing_camera: name a {CAMERA_FORM}")
    return PadSetting(family, markers, source, _camera(parse_qsl(said, keep_blank_values=True), camera))


def _marker(text: str, pad: str) -> PadMarker:
    number, _, rest = text.partition("=")
    side, _, at = rest.partition("@")
    try:
        right_m, up_m = (float(part) for part in at.split(",")) if at else (0.0, 0.0)
        marker = PadMarker(int(number), float(side), right_m, up_m)
    except ValueError:
        raise Unusable(f"landing_pad: {pad!r} must have the form {FORM}") from None
    if not (0 <= marker.number <= 255 and 0.0 < marker.side_m <= MAX_SIDE_M) or max(abs(right_m), abs(up_m)) > 10.0:
        raise Unusable(f"landing_pad: {text!r}: numbers are 0 to 255, sides and distances at most {MAX_SIDE_M:g} m")
    return marker


def _camera(pairs: Sequence[tuple[str, str]], camera: str) -> tuple[tuple[str, float], ...]:
    said = []
    for key, text in pairs:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if key not in _CAMERA_KEYS or not abs(value) <= 360.0 or (key == "fov" and not 0.0 < value < 180.0):
            raise Unusable(f"landing_camera: {camera!r}: {key}={text} is not one of {CAMERA_FORM}")
        said.append((key, value))
    return tuple(said)
