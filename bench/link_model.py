"""A link that delays, loses, repeats, reorders and throttles packets. No I/O; it is given the time and the chance.

One LinkModel is one direction of one link. A packet that goes in with `now` comes out as a list of (due time, packet):
empty where it is lost, two where it is repeated.
"""

from __future__ import annotations

import random
from dataclasses import asdict, dataclass
from typing import Any

BUFFER_S = 1.0
"""What may wait for a slow link; what would wait longer is dropped, as a router's full queue does."""


@dataclass(frozen=True, slots=True)
class Profile:
    """One direction. Probabilities 0..1, times in seconds."""

    delay_s: float = 0.0
    jitter_s: float = 0.0
    """Added to the delay, evenly from 0 to this. By itself it never changes the order."""
    loss: float = 0.0
    duplication: float = 0.0
    reordering: float = 0.0
    """Of packets that go at once, past those that are still on the way."""
    rate_bps: float = 0.0
    """Bits a second; 0 is no limit."""
    black_out: bool = False
    """Nothing gets through."""

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


class LinkModel:
    def __init__(self, profile: Profile, seed: int) -> None:
        self.profile = profile
        """May be replaced at any time; what is on the way stays so."""
        self._chance = random.Random(seed)
        self._free_at = 0.0
        self._last_due = 0.0
        self.lost = 0
        self.passed = 0
        self.passed_bytes = 0
        """Whole packets, with all headers from IP on."""

    def packet(self, data: bytes, now: float) -> list[tuple[float, bytes]]:
        """When `data`, sent now, arrives: (due time, packet) for each copy of it."""
        profile, chance = self.profile, self._chance
        # Always the same number of throws, so that one setting does not change what another does to later packets.
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
