"""Tracks the units that were sent and not yet acknowledged, and how late they are. No I/O.

There is one TCP connection, so units arrive in the order of sending. A unit leaves in pieces, at times set when it is
handed over (`Sent`), so that the duration of a large unit is not mistaken for a queue in the network.
"""

from collections import deque
from typing import Final, NamedTuple

from wire.video import Got

PIECE_BYTES: Final = 1350
"""With all headers, one packet of the usual size."""
PIECE_HEADER_BYTES: Final = 100
"""WebSocket, TLS, TCP with its timestamps, IP, and a share for the link layer."""
PIECE_S: Final = 0.002
"""Faster links send several pieces at once, because timers are not more precise than this."""

BASE_OVER_S: Final = 10.0
_BASE_PARTS: Final = 5
LARGE_OVER_S: Final = 4.0
LARGE_SHARE: Final = 0.6
BURST_S: Final = 0.4
"""Units that leave without a pause for longer than this count as another burst."""

UNKNOWN_BASE_S: Final = 0.3
"""Used until the first unit is acknowledged."""

MIN_NOISE_S: Final = 0.003
MAX_NOISE_S: Final = 0.008


def wire_bits(unit_bytes: int) -> int:
    """Size of a unit on the network, with all headers."""
    return 8 * (unit_bytes + -(-unit_bytes // PIECE_BYTES) * PIECE_HEADER_BYTES)


def piece_bytes(pacing_bps: float) -> int:
    """Bytes of a unit that leave at once."""
    return PIECE_BYTES * max(1, int(pacing_bps * PIECE_S / wire_bits(PIECE_BYTES)))


class Sent(NamedTuple):
    """One unit in transit. Its first piece leaves at `begins_at`, its last one at `leaves_at`; the next unit may begin
    after the duration of that last piece. `burst_bits`: bits of this unit and those that left before it without a
    pause, except for its last piece; `burst_s`: the time in which these left."""

    got: Got
    bits: int
    pacing_bps: float
    sent_at: float
    begins_at: float
    leaves_at: float
    burst_bits: int
    burst_s: float
    begins_burst: bool


class Arrival(NamedTuple):
    """An acknowledged unit. `late_s`: its delay beyond the fastest unit of the last seconds."""

    sent: Sent
    at: float
    late_s: float
    large: bool
    """The unit ends one of the largest bursts of the last seconds: only these measure the speed of the link."""


class UnitsInTransit:
    """The caller bounds the queue through `late_s` and `waiting_s` before sending; `oldest_s` detects a dead link."""

    def __init__(self) -> None:
        self._sent: deque[Sent] = deque()
        self._free_at = 0.0
        self._burst_at = 0.0
        self._burst_bits = 0
        self._bases: deque[tuple[float, float]] = deque()
        """(start of a part of the window, fastest round trip in it)."""
        self._large: deque[tuple[float, int]] = deque()
        self._last_way_s: float | None = None
        self._jitter_s = 0.0
        self.bits = 0
        """Bits of all units in transit."""

    def sent(self, got: Got, unit_bytes: int, pacing_bps: float, now: float) -> Sent:
        """Takes a unit that is handed over now. Returns when it has to leave."""
        bits = wire_bits(unit_bytes)
        piece = piece_bytes(pacing_bps)
        last_bits = wire_bits((unit_bytes - 1) % piece + 1)
        begins_burst = self._free_at <= now or self._free_at - self._burst_at > BURST_S
        if begins_burst:
            self._free_at = self._burst_at = max(self._free_at, now)
            self._burst_bits = 0
        begins_at = self._free_at
        leaves_at = begins_at + (bits - last_bits) / pacing_bps
        self._free_at = begins_at + bits / pacing_bps
        sent = Sent(
            got,
            bits,
            pacing_bps,
            sent_at=now,
            begins_at=begins_at,
            leaves_at=leaves_at,
            burst_bits=self._burst_bits + bits - last_bits,
            burst_s=leaves_at - self._burst_at,
            begins_burst=begins_burst,
        )
        self._burst_bits += bits
        self._sent.append(sent)
        self.bits += bits
        return sent

    def got(self, got: Got, now: float) -> Arrival | None:
        """Takes an answer. Returns None if no unit in transit matches it."""
        if not any(sent.got == got for sent in self._sent):
            return None
        while True:  # units sent earlier have arrived too, with or without an answer
            sent = self._sent.popleft()
            self.bits -= sent.bits
            if sent.got == got:
                break
        way_s = now - sent.leaves_at
        late_s = way_s - self._base(way_s, now)
        self._measure_noise(sent, way_s)
        return Arrival(sent, now, late_s, self._is_large(sent.burst_bits, now))

    def forget(self) -> None:
        """The connection is lost, and all units in transit with it."""
        self._sent.clear()
        self.bits = 0
        self._free_at = 0.0
        self._last_way_s = None
        self._bases.clear()

    def expect(self, base_s: float, now: float) -> None:
        """Sets the round-trip time of the link's previous use as the base."""
        self._bases.append((now, base_s))

    def rebase(self) -> None:
        """The route has become longer: discards the earlier minimum."""
        self._bases.clear()

    @property
    def base_s(self) -> float:
        """Round-trip time without any queue; 0 if unknown."""
        return min((way_s for _, way_s in self._bases), default=0.0)

    @property
    def noise_s(self) -> float:
        """Normal variation of the arrival time."""
        return min(MAX_NOISE_S, max(MIN_NOISE_S, self._jitter_s))

    def waiting_s(self, now: float) -> float:
        """Time until everything handed over has left this machine."""
        return max(0.0, self._free_at - now)

    def late_s(self, now: float) -> float:
        """Delay of the oldest unit in transit so far; 0 while it may still arrive in time."""
        if not self._sent:
            return 0.0
        base_s = self.base_s if self._bases else UNKNOWN_BASE_S
        return max(0.0, now - self._sent[0].leaves_at - base_s)

    def oldest_s(self, now: float) -> float:
        """Age of the oldest unit in transit; 0 if there is none."""
        return now - self._sent[0].sent_at if self._sent else 0.0

    def _base(self, way_s: float, now: float) -> float:
        bases = self._bases
        if not bases or now - bases[-1][0] >= BASE_OVER_S / _BASE_PARTS:
            bases.append((now, way_s))
        elif way_s < bases[-1][1]:
            bases[-1] = (bases[-1][0], way_s)
        while now - bases[0][0] > BASE_OVER_S and len(bases) > 1:
            bases.popleft()
        return self.base_s

    def _measure_noise(self, sent: Sent, way_s: float) -> None:
        """Uses units that did not wait for one another (after RFC 3550, 6.4.1)."""
        if self._last_way_s is not None and sent.begins_burst:
            change_s = min(2 * MAX_NOISE_S, abs(way_s - self._last_way_s))
            self._jitter_s += (change_s - self._jitter_s) / 16
        self._last_way_s = way_s

    def _is_large(self, bits: int, now: float) -> bool:
        large = self._large
        while large and (now - large[0][0] > LARGE_OVER_S):
            large.popleft()
        while large and large[-1][1] <= bits:
            large.pop()
        large.append((now, bits))
        return bits >= LARGE_SHARE * large[0][1]
