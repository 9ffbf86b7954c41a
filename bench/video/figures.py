"""Figures from the sights: delays, unseen pictures, age of the screen, drift, recovery (no I/O)."""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Sequence
from typing import Final

from bench.video.strip import Sight

TS_PACKET_BYTES: Final = 188
_SYNC: Final = 0x47
_ADAPTATION_ONLY: Final = 2
SAME_AGAIN_MS: Final = 25.0
"""A viewer within this of the usual delay has caught up."""
STAYS_MS: Final = 1000.0


def delays_ms(sights: Sequence[Sight]) -> list[float]:
    return [one.delay_ms for one in sights]


def unseen(sights: Sequence[Sight], rate_hz: float) -> int:
    """Returns how many pictures the camera made between the first and the last seen that were not seen."""
    if len(sights) < 2:
        return 0
    times = sorted(one.rendered_ms for one in sights)
    return max(round((times[-1] - times[0]) * rate_hz / 1000) + 1 - len(sights), 0)


def oldest_on_screen_ms(sights: Sequence[Sight], end_ms: float) -> float:
    """Returns the greatest age of the picture on the screen before a newer one arrived; the last one stays until
    `end_ms`."""
    if not sights:
        return float("nan")
    until = [*(one.seen_ms for one in sights[1:]), max(end_ms, sights[-1].seen_ms)]
    newest, worst = sights[0].rendered_ms, 0.0
    for one, gone_ms in zip(sights, until, strict=True):
        newest = max(newest, one.rendered_ms)
        worst = max(worst, gone_ms - newest)
    return worst


def drift_ms_per_minute(sights: Sequence[Sight]) -> float:
    """Returns the slope of the line through the medians of each ten seconds."""
    groups: dict[int, list[float]] = {}
    for one in sights:
        groups.setdefault(int((one.seen_ms - sights[0].seen_ms) // 10_000), []).append(one.delay_ms)
    if len(groups) < 2:
        return float("nan")
    slope, _ = statistics.linear_regression(list(groups), [statistics.median(group) for group in groups.values()])
    return slope * 6


def recovered_after_ms(sights: Sequence[Sight], ended_ms: float, usual_ms: float) -> float:
    """Returns the time from `ended_ms` until the delay is back to usual for a second; NaN if it never is.

    A twentieth of the pictures in that second may be late, because the usual delay is a p95.
    """
    after = [one for one in sights if one.seen_ms >= ended_ms]
    for one in after:
        if one.delay_ms > usual_ms + SAME_AGAIN_MS:
            continue
        second = [later for later in after if one.seen_ms <= later.seen_ms < one.seen_ms + STAYS_MS]
        late = sum(later.delay_ms > usual_ms + SAME_AGAIN_MS for later in second)
        if late <= len(second) / 20 and after[-1].seen_ms >= one.seen_ms + STAYS_MS:
            return one.seen_ms - ended_ms
    return float("nan")


def frozen_ms(sights: Sequence[Sight]) -> float:
    """Returns the longest time without a new picture."""
    return max((late.seen_ms - early.seen_ms for early, late in itertools.pairwise(sights)), default=0.0)


class TransportStream:
    """Counts missing MPEG-TS packets by their continuity counters, in pieces of any size."""

    def __init__(self) -> None:
        self.packets = 0
        self.missing = 0
        self.out_of_step = 0
        """Bytes that belong to no packet."""
        self._rest = b""
        self._next: dict[int, int] = {}

    def feed(self, piece: bytes) -> None:
        data = self._rest + piece
        at = 0
        while at + TS_PACKET_BYTES <= len(data):
            if data[at] != _SYNC:
                at += 1
                self.out_of_step += 1
                continue
            self._packet(int.from_bytes(data[at + 1 : at + 3], "big") & 0x1FFF, data[at + 3])
            at += TS_PACKET_BYTES
        self._rest = data[at:]

    def _packet(self, stream: int, flags: int) -> None:
        self.packets += 1
        if flags >> 4 & 3 == _ADAPTATION_ONLY or stream == 0x1FFF:
            return
        counter = flags & 0x0F
        if (expected := self._next.get(stream)) is not None:
            self.missing += (counter - expected) & 0x0F
        self._next[stream] = (counter + 1) & 0x0F
