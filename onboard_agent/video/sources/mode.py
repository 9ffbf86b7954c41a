"""The requested mode of a camera."""

from typing import NamedTuple


class Mode(NamedTuple):
    """Pixels and pictures per second; 0: as it suits the camera."""

    width: int = 0
    height: int = 0
    rate_hz: int = 0
