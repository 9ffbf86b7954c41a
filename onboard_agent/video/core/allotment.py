"""How the streams share what the link carries. No I/O.

Everyone's least first, then everyone's most, and in both the lower qualities before the higher: when there is little,
the higher quality gives way first.
"""

from collections.abc import Iterable
from typing import Final

from wire.video import LIMITS, Codec, Quality, StreamRequest

SHARE_OF_MPEG1: Final = {Codec.MPEG1: 1.0, Codec.H264: 0.6}
"""What a codec needs for the same picture."""

MIN_BPS: Final = 12_000
"""A stream that would get less rests."""

THIN_AFTER_S: Final = 2.0
NOT_THIN_FROM: Final = 1.2
"""Times what is needed."""


def least_bps(wish: StreamRequest) -> int:
    """Below this the picture is not what was asked for."""
    return round(LIMITS[wish.quality].least_bits_per_s * SHARE_OF_MPEG1[wish.codec])


def most_bps(wish: StreamRequest) -> int:
    """More than this helps nobody."""
    return round(LIMITS[wish.quality].bits_per_s * SHARE_OF_MPEG1[wish.codec])


def allot(budget_bps: float, wishes: Iterable[StreamRequest]) -> dict[StreamRequest, int]:
    """Bits a second for each; 0: it rests, because the others need everything. One stream alone never rests."""
    order = sorted(wishes, key=lambda wish: (wish.quality, -wish.codec))
    left = int(budget_bps)
    shares: dict[StreamRequest, int] = {}
    for wish in order:
        shares[wish] = min(left, least_bps(wish))
        left -= shares[wish]
    for wish in order:
        more = min(left, most_bps(wish) - shares[wish])
        shares[wish] += more
        left -= more
    for place, wish in enumerate(order):
        if shares[wish] < MIN_BPS:
            shares[wish] = MIN_BPS if place == 0 else 0
    return shares


class Thinness:
    """Whether the link takes less than the least of what is watched, and has for a while."""

    def __init__(self) -> None:
        self.thin = False
        self._since: float | None = None

    def judge(self, budget_bps: float, wishes: Iterable[StreamRequest], now: float) -> bool:
        """Whether it is so now."""
        needed = sum(least_bps(wish) for wish in wishes)
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
    """For log lines."""
    return quality.name.lower()
