"""When each picture of a recording is shown: as long after the first as it was taken after it. Pure."""

import itertools
from collections.abc import Sequence
from statistics import median
from typing import Final, NamedTuple

TICKS_PER_S: Final = 90_000
"""The unit of time in the finished file."""
_MIN_STEP: Final = 90
"""A millisecond: two pictures never share a moment, whatever the clocks say."""


class Taken(NamedTuple):
    """Microseconds of one monotonic clock. `capture_us`: 0 where nobody knew; `came_us`: when the tower got it."""

    capture_us: int
    came_us: int
    rate_hz: float


class Shown(NamedTuple):
    """In ticks from the beginning of the file."""

    at: int
    lasts: int


def shown_times(taken: Sequence[Taken]) -> list[Shown]:
    """One for each picture. A picture stays until the next one, also through a pause; the last stays for one period.

    Where the time of capture is not known it is guessed from when the picture came, by the least delay that was seen.
    A time that lies before that of an earlier picture, or further off than any network explains, is not believed.
    """
    if not taken:
        return []
    lag_us = _least_lag(taken)
    moments = [_moment(one, lag_us) for one in taken]
    first = moments[0]
    at: list[int] = []
    for moment in moments:
        ticks = round((moment - first) * TICKS_PER_S / 1_000_000)
        at.append(ticks if not at else max(ticks, at[-1] + _MIN_STEP))
    steps = [later - earlier for earlier, later in itertools.pairwise(at)]
    period = round(TICKS_PER_S / taken[-1].rate_hz)
    # The rate is what the encoder aims at; what came says it better, unless there was a pause.
    last = min(period, round(median(steps[-30:]))) if steps else period
    return [Shown(moment, step) for moment, step in zip(at, [*steps, max(_MIN_STEP, last)], strict=True)]


MAX_LAG_US: Final = 30_000_000


def _least_lag(taken: Sequence[Taken]) -> int:
    lags = [one.came_us - one.capture_us for one in taken if one.capture_us]
    return min((lag for lag in lags if 0 <= lag <= MAX_LAG_US), default=0)


def _moment(one: Taken, lag_us: int) -> int:
    believed = one.capture_us and -1_000_000 <= one.came_us - one.capture_us <= MAX_LAG_US
    return one.capture_us if believed else one.came_us - lag_us
