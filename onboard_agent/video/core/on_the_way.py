"""Units sent and not yet received, and how late they are. No I/O.

One TCP connection: units arrive in order. A unit leaves in pieces, at times that are set when it is handed over
(`Sent`), so that the transmission time of a large unit is not taken for a queue in the network.
"""

from collections import deque
from typing import Final, NamedTuple

from wire.video import Got

PIECE_BYTES: Final = 1350
"""With all headers one packet of the usual size."""
PIECE_HEADER_BYTES: Final = 100
"""WebSocket, TLS, TCP with its time stamps, IP, and a share of the link's own."""
PIECE_S: Final = 0.002
"""Faster links take several at once: no timer is finer than that."""

BASE_OVER_S: Final = 10.0
_BASE_PARTS: Final = 5
LARGE_OVER_S: Final = 4.0
LARGE_SHARE: Final = 0.6
BURST_S: Final = 0.4
"""What leaves without a pause for longer counts as another burst."""

UNKNOWN_BASE_S: Final = 0.3
"""As long as nothing has been got."""

MIN_NOISE_S: Final = 0.003
MAX_NOISE_S: Final = 0.008


def wire_bits(unit_bytes: int) -> int:
    """What a unit is on the network, with all headers."""
    return 8 * (unit_bytes + -(-unit_bytes // PIECE_BYTES) * PIECE_HEADER_BYTES)


def piece_bytes(pacing_bps: float) -> int:
    """How much of a unit leaves at once."""
    return PIECE_BYTES * max(1, int(pacing_bps * PIECE_S / wire_bits(PIECE_BYTES)))


class Sent(NamedTuple):
    """One unit on its way. Its first piece leaves at `begins_at`, its last one at `leaves_at`, and then the next unit
    may begin after that piece's own time. `burst_bits`: with those before it that left without a pause between, but
    for the last piece; `burst_s`: in which these left."""

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
    """One unit that has been got. `late_s`: by how much more than the quickest of the last seconds took."""

    sent: Sent
    at: float
    late_s: float
    large: bool
    """It ends one of the largest bursts of the last seconds: only these tell how fast the link is."""


class OnTheWay:
    """Bounded by the caller, which checks `late_s` and `waiting_s` before sending; `oldest_s` shows when there is no
    hope left."""

    def __init__(self) -> None:
        self._sent: deque[Sent] = deque()
        self._free_at = 0.0
        self._burst_at = 0.0
        self._burst_bits = 0
        self._bases: deque[tuple[float, float]] = deque()
        """(begin of the part of the window, the quickest way in it)."""
        self._large: deque[tuple[float, int]] = deque()
        self._last_way_s: float | None = None
        self._jitter_s = 0.0
        self.bits = 0
        """Of everything on its way."""

    def sent(self, got: Got, unit_bytes: int, pacing_bps: float, now: float) -> Sent:
        """A unit is handed over now. Returns when it has to leave."""
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
        """None: it is none of those that are on their way."""
        if not any(sent.got == got for sent in self._sent):
            return None
        while True:  # what was sent before has come too, whether told or not
            sent = self._sent.popleft()
            self.bits -= sent.bits
            if sent.got == got:
                break
        way_s = now - sent.leaves_at
        late_s = way_s - self._base(way_s, now)
        self._measure_noise(sent, way_s)
        return Arrival(sent, now, late_s, self._is_large(sent.burst_bits, now))

    def forget(self) -> None:
        """The connection is gone, and everything on its way with it."""
        self._sent.clear()
        self.bits = 0
        self._free_at = 0.0
        self._last_way_s = None
        self._bases.clear()

    def expect(self, base_s: float, now: float) -> None:
        """The round trip when the path was used before."""
        self._bases.append((now, base_s))

    def rebase(self) -> None:
        """The way has become longer: what was the quickest is not to be had any more."""
        self._bases.clear()

    @property
    def base_s(self) -> float:
        """There and back, without any queue; 0 where nothing is known."""
        return min((way_s for _, way_s in self._bases), default=0.0)

    @property
    def noise_s(self) -> float:
        """So much earlier or later a unit may be for no reason of ours."""
        return min(MAX_NOISE_S, max(MIN_NOISE_S, self._jitter_s))

    def waiting_s(self, now: float) -> float:
        """Until all that is sent has left this machine."""
        return max(0.0, self._free_at - now)

    def late_s(self, now: float) -> float:
        """By how much the oldest that is on its way is late by now; 0 while it may still come in time."""
        if not self._sent:
            return 0.0
        base_s = self.base_s if self._bases else UNKNOWN_BASE_S
        return max(0.0, now - self._sent[0].leaves_at - base_s)

    def oldest_s(self, now: float) -> float:
        """The age of the oldest that is on its way; 0 where nothing is."""
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
        """By units that did not wait for one another (after RFC 3550, 6.4.1)."""
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
