"""The mode requested from a camera."""

from typing import NamedTuple


class Mode(NamedTuple):
    """Pixels and pictures per second; 0: the camera's choice."""

    width: int = 0
    height: int = 0
    rate_hz: int = 0
