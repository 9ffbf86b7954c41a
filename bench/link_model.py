"""A link that delays, loses, repeats, reorders and throttles packets. No I/O; takes the time and the randomness.

One LinkModel is one direction of one link. A packet that enters with `now` results in a list of (due time, packet):
empty if it is lost, two if it is repeated.
"""

from __future__ import annotations

import random
from dataclasses import asdict, dataclass
from typing import Any

BUFFER_S = 1.0
"""Queue limit of a slow link; packets that would wait longer are dropped, as by a router's full queue."""


@dataclass(frozen=True, slots=True)
class Profile:
    """One direction. Probabilities 0..1, times in seconds."""

    delay_s: float = 0.0
    jitter_s: float = 0.0
    """Added to the delay, uniformly from 0 to this. By itself it never changes the order."""
    loss: float = 0.0
    duplication: float = 0.0
    reordering: float = 0.0
    """Share of packets that leave at once, overtaking those in transit."""
    rate_bps: float = 0.0
    """Bits per second; 0 is no limit."""
    black_out: bool = False
    """Drops all packets."""

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


class LinkModel:
    def __init__(self, profile: Profile, seed: int) -> None:
        self.profile = profile
        """May be replaced at any time; packets in transit keep their times."""
        self._chance = random.Random(seed)
        self._free_at = 0.0
        self._last_due = 0.0
        self.lost = 0
        self.passed = 0
        self.passed_bytes = 0
        """Whole packets, with all headers from IP on."""

    def packet(self, data: bytes, now: float) -> list[tuple[float, bytes]]:
        """Returns when `data`, sent now, arrives: (due time, packet) for each copy of it."""
        profile, chance = self.profile, self._chance
        # Always the same number of draws, so that one setting does not change the effect of another on later packets.
        lost, repeated, overtakes, jitter = (chance.random() for _ in range(4))
        if profile.black_out or lost < profile.loss:
            self.lost += 1
            return []
        sent_at = now
        if profile.rate_bps > 0:
            begin = max(now, self._free_at)
            if begin - now > BUFFER_S:
                self.lost += 1
                return []
            sent_at = self._free_at = begin + len(data) * 8 / profile.rate_bps
        if overtakes < profile.reordering:
            due = sent_at
        else:
            due = self._last_due = max(sent_at + profile.delay_s + jitter * profile.jitter_s, self._last_due)
        self.passed += 1
        self.passed_bytes += len(data)
        copies = 2 if repeated < profile.duplication else 1
        return [(due, data)] * copies
