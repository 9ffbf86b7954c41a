"""Compares what an encoder produces, headers included, with the bit rate it was given. No I/O."""

from typing import Final

OVER_S: Final = 2.0
MAX_FACTOR: Final = 2.5


class Overshoot:
    """For one stream. `factor`: divide the available rate by this to get the rate to request."""

    def __init__(self) -> None:
        self.factor = 1.1
        self._begun_at: float | None = None
        self._made = 0
        self._asked = 0.0
        self._last_at = 0.0

    def made(self, bits: int, asked_bps: float, now: float) -> None:
        """Takes a unit of `bits`, headers included, made while the encoder was set to `asked_bps`."""
        if self._begun_at is None or now - self._last_at > 1.0:  # the encoder did not save bits by skipped pictures
            self._begun_at = self._last_at = now
            self._made, self._asked = 0, 0.0
            return
        self._made += bits
        self._asked += asked_bps * (now - self._last_at)
        self._last_at = now
        if now - self._begun_at >= OVER_S and self._asked > 0:
            self.factor += (min(MAX_FACTOR, max(1.0, self._made / self._asked)) - self.factor) / 2
            self._begun_at, self._made, self._asked = now, 0, 0.0
