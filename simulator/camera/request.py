"""The parameters of a viewer's request: `/camera?width=640&height=480&rate=30`."""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import parse_qsl, urlsplit

CAMERA_PATH = "/camera"
UNPLUG_PATH = "/unplug"
MAX_NAME_LENGTH = 32
LIMITS = {
    "width": (64, 1920, 640),
    "height": (48, 1080, 480),
    "rate": (1, 60, 30),
    "tilt": (0, 90, 20),
    "fov": (30, 120, 75),
    "quality": (30, 95, 85),
}
"""Minimum, maximum, default."""
MAX_UNPLUG_S = 3600


class BadRequest(ValueError):
    """One clear line for the client."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """Pixels; pictures per second; degrees down from ahead; horizontal field of view in degrees; JPEG quality; the text
    in the picture."""

    width: int
    height: int
    rate: int
    tilt: int
    fov: int
    quality: int
    name: str


def read_wanted(target: str, name: str) -> Wanted:
    """`name` is drawn into the picture unless the URL has one. Raises BadRequest."""
    asked = dict(parse_qsl(urlsplit(target).query, keep_blank_values=True))
    name = asked.pop("name", name)
    if len(name) > MAX_NAME_LENGTH or not (name.isascii() and name.isprintable()):
        raise BadRequest(f"name: up to {MAX_NAME_LENGTH} plain letters")
    numbers = {key: _number(asked.pop(key, None), key, LIMITS[key]) for key in LIMITS}
    if asked:
        raise BadRequest(f"{next(iter(asked))!r} is none of {', '.join(LIMITS)}, name")
    return Wanted(**numbers, name=name)


def read_unplugged_s(target: str) -> float:
    """Returns simulated seconds. Raises BadRequest."""
    asked = dict(parse_qsl(urlsplit(target).query))
    return float(_number(asked.get("seconds"), "seconds", (1, MAX_UNPLUG_S, 5)))


def _number(text: str | None, key: str, limits: tuple[int, int, int]) -> int:
    least, most, default = limits
    if text is None:
        return default
    if not (text.isascii() and text.isdecimal() and len(text) < 6 and least <= int(text) <= most):
        raise BadRequest(f"{key} is a whole number from {least} to {most}")
    return int(text)
