"""Computes when a picture was taken from the timestamps of a camera with its own clock (no I/O).

Timestamps give exact intervals between pictures; arrival times include network delay. The fastest arrival of the last
seconds gives the offset between the clocks; the additional delay of other pictures counts as their age.
"""

from typing import Final

_WINDOW_US: Final = 5_000_000
_MAX_JUMP_US: Final = 2_000_000
"""A timestamp that is off by more belongs to another epoch: the camera has restarted, or set its clock."""


class ArrivalClock:
    """For one camera. Forgets after 10 s, so that clock drift does no harm."""

    def __init__(self) -> None:
        self._best_us: int | None = None
        self._before_us: int | None = None
        self._window_ends_us = 0

    def taken_us(self, stamp_us: int, arrived_us: int) -> int:
        """Returns the time by our clock, never later than the arrival."""
        apart_us = arrived_us - stamp_us
        known = [best for best in (self._best_us, self._before_us) if best is not None]
        if known and abs(apart_us - min(known)) > _MAX_JUMP_US:
            self._best_us = self._before_us = None
            known = []
        if self._best_us is None or arrived_us >= self._window_ends_us:
            self._before_us, self._best_us = self._best_us, apart_us
            self._window_ends_us = arrived_us + _WINDOW_US
        self._best_us = min(self._best_us, apart_us)
        return stamp_us + min([*known, self._best_us])
