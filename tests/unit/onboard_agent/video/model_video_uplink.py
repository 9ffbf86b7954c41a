"""A model of the path from the agent to the tower, and of its encoder: fake clock, seeded, no sleeping.

Units are sent in paced pieces. The bottleneck is a queue served at a rate. A lost packet delays its unit and all
following ones until TCP resends it. Acknowledgements return without loss.
"""

from __future__ import annotations

import heapq
import random
from dataclasses import dataclass, field

from onboard_agent.video.core.link_rate import Known, LinkRate
from onboard_agent.video.core.shape_for_bits import ShapeForBits
from onboard_agent.video.core.units_in_transit import PIECE_BYTES, wire_bits
from wire.video import LIMITS, Codec, Got, Quality, StreamRequest

TICK_S = 0.001
SHAPED_EVERY_S = 0.1
HEADERS_BYTES = 250
"""Size of a unit beyond the encoder's target."""


@dataclass
class Conditions:
    """Conditions of the link, from some time on."""

    rate_bps: float
    rtt_s: float = 0.05
    loss: float = 0.0
    time_outs: float = 0.0
    """The share of the lost packets that TCP resends only after a time-out, some of them after twice that."""
    jitter_s: float = 0.0
    other_bps: float = 0.0
    """Cross traffic in the same queue."""
    stalls_s: float = 0.0
    """A busy computer: twice a second, on average, it processes nothing for up to this time, then everything at
    once."""


@dataclass
class Second:
    """Measurements of one second."""

    got_bps: float = 0.0
    pictures: int = 0
    worst_queue_s: float = 0.0
    """In the network: how long a telemetry packet would wait behind pictures."""
    worst_age_s: float = 0.0
    """From the capture of a picture until the tower has it."""
    budget_bps: float = 0.0
    pacing_bps: float = 0.0
    ages_s: list[float] = field(default_factory=list)


class ModelUplink:
    """Runs a LinkRate against changing conditions; `seconds` holds the measurements. `shaped`: pictures of that quality
    are as few as ShapeForBits allows."""

    def __init__(
        self,
        *,
        ceiling_bps: float,
        rate_hz: float = 24.0,
        gop_s: float = 0.75,
        key: float = 4.0,
        seed: int = 1,
        shaped: Quality | None = None,
    ) -> None:
        self.now = 0.0
        self.rate = LinkRate(0.0)
        self.seconds: list[Second] = []
        self._ceiling_bps = ceiling_bps
        self._rate_hz = rate_hz
        self._gop = max(2, round(gop_s * rate_hz))
        self._key = key
        self._chance = random.Random(seed)
        self._next_picture = 0.0
        self._number = 0
        self._since_key = 0
        self._host_free_at = 0.0
        self._link_free_at = 0.0
        self._in_order_at = 0.0
        self._deaf_until = 0.0
        self._answers: list[tuple[float, int, Got]] = []
        self._shapes = None if shaped is None else ShapeForBits(StreamRequest(shaped, Codec.MPEG1))
        self._shaped_at = 0.0
        self.whole_rate_at: float | None = None
        """When a shaped stream first had all pictures of its quality."""

    def run(self, conditions: Conditions, seconds: int) -> list[Second]:
        """Returns the measurements of these seconds."""
        first = len(self.seconds)
        for _ in range(seconds):
            second = Second()
            self.seconds.append(second)
            end = self.now + 1.0
            while self.now < end:
                self._step(conditions, second)
                self.now += TICK_S
            second.budget_bps, second.pacing_bps = self.rate.budget_bps, self.rate.pacing_bps
        return self.seconds[first:]

    def another_stream(self, hoped: Known | None, *, after_s: float = 10.0) -> None:
        """Starts another stream after a pause without viewers, in which the network has emptied."""
        self.now += after_s
        self._next_picture, self._since_key = self.now, 0
        self._answers.clear()
        self.rate.begin(self.now, hoped)
        if self._shapes is not None:
            self._shapes = ShapeForBits(self._shapes.request)
        self._shaped_at, self.whole_rate_at = self.now, None

    def _shape(self) -> None:
        assert self._shapes is not None
        self._shaped_at += SHAPED_EVERY_S
        limits = LIMITS[self._shapes.request.quality]
        bits_per_s = round(min(limits.bits_per_s, self.rate.budget_bps) / 1.1)
        self._rate_hz = self._shapes.choose(bits_per_s, self.now, is_free=self.rate.is_free(self.now)).rate_hz
        if self._rate_hz == limits.rate_hz and self.whole_rate_at is None:
            self.whole_rate_at = self.now

    def _step(self, conditions: Conditions, second: Second) -> None:
        if self._shapes is not None and self.now >= self._shaped_at:
            self._shape()
        if conditions.stalls_s and self._chance.random() < 2 * TICK_S:
            self._deaf_until = self.now + self._chance.random() * conditions.stalls_s
        while self._answers and self._answers[0][0] <= self.now and self.now >= self._deaf_until:
            _, bits, got = heapq.heappop(self._answers)
            self.rate.got(got, self.now)
            second.got_bps += bits
        if conditions.other_bps:
            self._link_free_at = max(self._link_free_at, self.now)
            self._link_free_at += TICK_S * conditions.other_bps / conditions.rate_bps
        if self.now >= self._next_picture:
            self._next_picture += 1.0 / self._rate_hz
            if self.rate.has_room(self.now):
                self._picture(conditions, second)

    def _picture(self, conditions: Conditions, second: Second) -> None:
        bits = min(self._ceiling_bps, self.rate.budget_bps) / self._rate_hz
        # Makes a group the requested size: one key picture, `key` times as large as the others.
        plain = bits * self._gop / (self._gop - 1 + self._key)
        is_key = self._since_key == 0
        self._since_key = (self._since_key + 1) % self._gop
        size = int(plain * (self._key if is_key else 1.0) * self._chance.uniform(0.7, 1.3) / 8) + HEADERS_BYTES
        self._number += 1
        got = Got(Quality.MEDIUM, Codec.MPEG1, self._number)
        taken_at = self.now
        self.rate.sent(got, size, self.now)
        arrives = self._carry(size, conditions, second)
        second.pictures += 1
        age = arrives - taken_at
        second.ages_s.append(age)
        second.worst_age_s = max(second.worst_age_s, age)
        heapq.heappush(self._answers, (arrives + conditions.rtt_s / 2, wire_bits(size), got))

    def _carry(self, size: int, conditions: Conditions, second: Second) -> float:
        """Returns the arrival time of its last packet."""
        arrives = 0.0
        left = size
        while left > 0:
            bits = wire_bits(min(left, PIECE_BYTES))
            left -= PIECE_BYTES
            leaves_at = max(self._host_free_at, self.now)
            self._host_free_at = leaves_at + bits / self.rate.pacing_bps
            second.worst_queue_s = max(second.worst_queue_s, self._link_free_at - leaves_at)
            self._link_free_at = max(self._link_free_at, leaves_at) + bits / conditions.rate_bps
            arrives = self._link_free_at + conditions.rtt_s / 2 + self._chance.random() * conditions.jitter_s
            if self._chance.random() < conditions.loss:
                arrives += conditions.rtt_s * 1.25 + 2.0 / self._rate_hz
                if conditions.time_outs and self._chance.random() < conditions.time_outs:
                    arrives += self._chance.choice((0.25, 0.5))
            self._in_order_at = arrives = max(arrives, self._in_order_at)
        return arrives
