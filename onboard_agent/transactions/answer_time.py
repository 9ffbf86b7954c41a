"""Adapts the time to wait for an answer to the time that earlier answers took. No I/O; times in seconds.

Uses the smoothed mean and deviation of the round trip, as TCP does (RFC 6298): a lost request is repeated after about
one round trip, within milliseconds on a fast line, and never before the answer can have arrived on a slow one.
"""

from typing import Final

MIN_S: Final = 0.06
"""An autopilot polls its line 50 to 400 times a second, and some of its tasks delay that further."""
MEAN_WEIGHT: Final = 1 / 8
DEVIATION_WEIGHT: Final = 1 / 4
DEVIATIONS: Final = 4.0


class AnswerTime:
    """`first_s`: the wait before the first measurement, and the longest wait."""

    def __init__(self, first_s: float) -> None:
        self._first_s = first_s
        self._mean_s: float | None = None
        self._deviation_s = 0.0

    def measured(self, took_s: float) -> None:
        """Records the time one answer took. Do not call it if the answer may belong to either of two requests."""
        if self._mean_s is None:
            self._mean_s, self._deviation_s = took_s, took_s / 2
            return
        self._deviation_s += DEVIATION_WEIGHT * (abs(took_s - self._mean_s) - self._deviation_s)
        self._mean_s += MEAN_WEIGHT * (took_s - self._mean_s)

    def wait_s(self, tries: int) -> float:
        """Returns how long to wait after the request was sent `tries` times. Each retry doubles the wait."""
        if self._mean_s is None:
            return self._first_s
        usual_s = max(MIN_S, self._mean_s + DEVIATIONS * self._deviation_s)
        return float(min(self._first_s, usual_s * 2 ** min(tries - 1, 8)))
