"""Selects the camera's pictures for a stream, so that it gets its picture rate. No I/O."""

from typing import Final

SLACK: Final = 0.3
"""Share of an interval: a picture that is early by at most this is still taken."""

BEHIND: Final = 2.0
"""Intervals. After a longer pause, missed pictures are not made up for."""


class Cadence:
    """Call `takes` with the time of each picture, in microseconds of one clock."""

    def __init__(self) -> None:
        self._due_us = 0.0

    def takes(self, capture_us: int, rate_hz: float) -> bool:
        """Whether this picture is one of `rate_hz` per second. Its turn is over even if it is not encoded then."""
        interval_us = 1e6 / rate_hz
        if capture_us < self._due_us - SLACK * interval_us:
            return False
        self._due_us += interval_us
        if capture_us > self._due_us + BEHIND * interval_us:
            self._due_us = capture_us + interval_us
        return True
