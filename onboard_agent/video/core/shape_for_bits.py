"""Chooses the shape of a stream's pictures for its bit rate: first fewer bits, then fewer pictures, then smaller ones.
No I/O."""

from typing import Final, NamedTuple

from onboard_agent.video.core.allotment import max_bps
from wire.video import LIMITS, StreamRequest


class Shape(NamedTuple):
    """`bits_per_s` at `rate_hz` pictures per second; `scale`: factor for the quality's width and height."""

    bits_per_s: int
    rate_hz: float
    scale: float


class _Step(NamedTuple):
    from_share: float
    """Minimum share of the quality's maximum bit rate."""
    rate: float
    scale: float


_STEPS: Final = (
    _Step(0.45, 1.0, 1.0),
    _Step(0.28, 2 / 3, 1.0),
    _Step(0.16, 1 / 2, 1.0),
    _Step(0.09, 1 / 2, 3 / 4),
    _Step(0.0, 1 / 3, 1 / 2),
)

UP_FROM: Final = 1.2
UP_AFTER_S: Final = 3.0
"""A better shape is chosen only after a fifth more than its minimum has been available for this long, because a change
of size is visible."""


class ShapeForBits:
    """Shape of one stream."""

    def __init__(self, request: StreamRequest) -> None:
        self.request = request
        self._limits = LIMITS[request.quality]
        self._most_bps = max_bps(request)
        self._step: int | None = None
        self._better_since: float | None = None

    def choose(self, bits_per_s: int, now: float, *, is_free: bool = False) -> Shape:
        """Returns the shape for these bits. Degrades at once; improves after a while, or at once if `is_free`."""
        share = bits_per_s / self._most_bps
        fitting = next(number for number, step in enumerate(_STEPS) if share >= step.from_share)
        if self._step is None or fitting > self._step or (is_free and fitting < self._step):
            self._step, self._better_since = fitting, None
        elif self._step > 0 and share >= UP_FROM * _STEPS[self._step - 1].from_share:
            if self._better_since is None:
                self._better_since = now
            elif now - self._better_since >= UP_AFTER_S:
                self._step, self._better_since = self._step - 1, now
        else:
            self._better_since = None
        step = _STEPS[self._step]
        return Shape(bits_per_s, self._limits.rate_hz * step.rate, step.scale)
