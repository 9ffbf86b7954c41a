"""How long to wait before the next attempt. No I/O; randomness is passed in.

The longest wait is 2 s, so that after a restart of the tower every agent is back within 3 s. The jitter keeps the
drones of a squad from connecting all at the same moment.
"""

import random
from collections.abc import Callable
from typing import Final

STEADY_S: Final = 1.0
"""A connection that lasted this long is renewed at once. One that ends sooner waits like a failed attempt."""

FIRST_S: Final = 0.25
MAX_DURATION_S: Final = 2.0


class Backoff:
    """No wait first, then 0.25 s, doubling up to 2 s, each shortened at random by up to a half."""

    def __init__(self, fraction: Callable[[], float] = random.random) -> None:
        self._fraction = fraction
        self._wait_s = 0.0

    def next_delay_s(self) -> float:
        """Returns the seconds to wait before the next attempt."""
        delay_s = self._wait_s * (1.0 - self._fraction() / 2.0)
        self._wait_s = min(MAX_DURATION_S, self._wait_s * 2.0) if self._wait_s else FIRST_S
        return delay_s

    def reset(self) -> None:
        """An attempt has succeeded: after the next failure, the first retry is immediate."""
        self._wait_s = 0.0
