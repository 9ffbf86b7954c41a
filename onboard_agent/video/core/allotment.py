"""Divides the capacity of the link among the streams. No I/O.

Every stream first gets its minimum, then its maximum, lower qualities before higher ones: when capacity is short, the
higher quality is reduced first.
"""

from collections.abc import Iterable
from typing import Final

from wire.video import LIMITS, Codec, Quality, StreamRequest

SHARE_OF_MPEG1: Final = {Codec.MPEG1: 1.0, Codec.H264: 0.6}
"""Bits that a codec needs for the same picture, relative to MPEG-1."""

MIN_BPS: Final = 12_000
"""A stream whose share would be less is paused."""

THIN_AFTER_S: Final = 2.0
NOT_THIN_FROM: Final = 1.2
"""Factor above the required rate."""


def min_bps(request: StreamRequest) -> int:
    """Minimum rate; below it the picture is not of the requested quality."""
    return round(LIMITS[request.quality].least_bits_per_s * SHARE_OF_MPEG1[request.codec])


def max_bps(request: StreamRequest) -> int:
    """Maximum rate; more does not improve the picture."""
    return round(LIMITS[request.quality].bits_per_s * SHARE_OF_MPEG1[request.codec])


def allot(budget_bps: float, requests: Iterable[StreamRequest]) -> dict[StreamRequest, int]:
    """Bits per second for each stream; 0: paused, because the others need everything. One alone is never paused."""
    order = sorted(requests, key=lambda request: (request.quality, -request.codec))
    left = int(budget_bps)
    shares: dict[StreamRequest, int] = {}
    for request in order:
        shares[request] = min(left, min_bps(request))
        left -= shares[request]
    for request in order:
        more = min(left, max_bps(request) - shares[request])
        shares[request] += more
        left -= more
    for place, request in enumerate(order):
        if shares[request] < MIN_BPS:
            shares[request] = MIN_BPS if place == 0 else 0
    return shares


class Thinness:
    """Detects that the link has carried less than the minimum of the watched streams for a while."""

    def __init__(self) -> None:
        self.thin = False
        self._since: float | None = None

    def judge(self, budget_bps: float, requests: Iterable[StreamRequest], now: float) -> bool:
        """Returns whether the link is thin now."""
        needed = sum(min_bps(request) for request in requests)
        if self.thin:
            self.thin = needed > 0 and budget_bps < NOT_THIN_FROM * needed
            self._since = None
        elif budget_bps >= needed:
            self._since = None
        elif self._since is None:
            self._since = now
        elif now - self._since >= THIN_AFTER_S:
            self.thin = True
        return self.thin


def quality_word(quality: Quality) -> str:
    """Name of the quality for log lines."""
    return quality.name.lower()
