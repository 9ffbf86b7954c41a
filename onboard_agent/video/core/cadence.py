"""Which of the camera's pictures a stream takes, so that it has as many as it is to have. No I/O."""

from typing import Final

SLACK: Final = 0.3
"""Share of an interval: a picture this much too early still counts."""

BEHIND: Final = 2.0
"""Intervals. After a longer pause nothing is made up for."""


class Cadence:
    """Asked with the time of each picture, in microseconds of one clock."""

    def __init__(self) -> None:
        self._due_us = 0.0

    def takes(self, capture_us: int, rate_hz: float) -> bool:
        """Whether this picture is one of `rate_hz` a second. Even if it is then not encoded, its turn is over."""
        interval_us = 1e6 / rate_hz
        if capture_us < self._due_us - SLACK * interval_us:
            return False
        self._due_us += interval_us
        if capture_us > self._due_us + BEHIND * interval_us:
            self._due_us = capture_us + interval_us
        return True
