"""Decides which pictures are encoded for which stream, and makes units from them. No I/O.

A picture is dropped before it is encoded, never after: an encoded picture must be sent, or the next picture of that
stream must be a key picture.
"""

from collections.abc import Iterable
from typing import Final, NamedTuple

from onboard_agent.video.core.allotment import Thinness, allot
from onboard_agent.video.core.cadence import Cadence
from onboard_agent.video.core.link_rate import LinkRate
from onboard_agent.video.core.overshoot import Overshoot
from onboard_agent.video.core.shape_for_bits import Shape, ShapeForBits
from onboard_agent.video.core.units_in_transit import Sent, wire_bits
from wire.video import HEADER_BYTES, MAX_UNIT_BYTES, Got, StreamRequest, Unit, encode_unit

MAX_HELD_MS: Final = 0xFFFF
KEY_ASKED_PAUSE_S: Final = 0.3
"""Minimum interval between requested key pictures: a key picture costs as much as several others."""


class Order(NamedTuple):
    """One picture for one stream."""

    request: StreamRequest
    shape: Shape
    force_key: bool
    is_break: bool


class Encoded(NamedTuple):
    """The encoder's result for an order."""

    payload: bytes
    key: bool
    width: int
    height: int
    capture_us: int
    is_break: bool


class Departure(NamedTuple):
    """A unit, and when it leaves."""

    message: bytes
    sent: Sent


class _Stream:
    def __init__(self, request: StreamRequest) -> None:
        self.cadence = Cadence()
        self.shapes = ShapeForBits(request)
        self.overshoot = Overshoot()
        self.shape: Shape | None = None
        """None: the stream is paused."""
        self.key_due = True
        self.break_due = False
        self.key_asked_at = float("-inf")
        self.rests_until = float("-inf")


class Streaming:
    """All streams of one camera over one link."""

    def __init__(self, now: float) -> None:
        self.rate = LinkRate(now)
        self.left_out = 0
        """Pictures due for a stream but dropped, because they would have been late."""
        self.thin = False
        self._streams: dict[StreamRequest, _Stream] = {}
        self._sequences: dict[StreamRequest, int] = {}
        """Continue when a stream is watched again."""
        self._thinness = Thinness()

    def watch(self, requests: Iterable[StreamRequest], now: float) -> None:
        """Sets the watched streams."""
        before = self._streams
        self._streams = {request: before.get(request) or _Stream(request) for request in requests}
        self.tick(now)

    @property
    def watched(self) -> tuple[StreamRequest, ...]:
        return tuple(self._streams)

    def restart(self) -> None:
        """Discards what was sent: every stream continues with a key picture, to which nothing before leads up. The
        camera may have opened before the channel did."""
        for stream in self._streams.values():
            stream.key_due = stream.break_due = True

    def key_wanted(self, request: StreamRequest, now: float) -> None:
        """The tower requests a key picture."""
        stream = self._streams.get(request)
        if stream is not None and now - stream.key_asked_at >= KEY_ASKED_PAUSE_S:
            stream.key_due, stream.key_asked_at = True, now

    def rest(self, request: StreamRequest, until: float) -> None:
        """The encoder of the stream has failed: pauses the stream until then."""
        stream = self._streams.get(request)
        if stream is not None:
            stream.rests_until, stream.key_due = until, True

    def tick(self, now: float) -> None:
        """Divides the capacity of the link among the streams; call about every 100 ms."""
        budget = self.rate.budget_bps
        self.thin = self._thinness.judge(budget, self._streams, now)
        shares = allot(budget, self._streams)
        for request, stream in self._streams.items():
            if shares[request] == 0:
                stream.shape, stream.key_due = None, True
            else:
                bits_per_s = round(shares[request] / stream.overshoot.factor)
                stream.shape = stream.shapes.choose(bits_per_s, now, is_free=self.rate.is_free(now))

    def orders(self, capture_us: int, now: float, *, is_break: bool = False) -> list[Order]:
        """Returns the streams for which to encode this picture now, and how."""
        orders = []
        has_room: bool | None = None
        for request, stream in self._streams.items():
            stream.break_due |= is_break
            if stream.shape is None or now < stream.rests_until:
                continue
            if not stream.cadence.takes(capture_us, stream.shape.rate_hz):
                continue
            if has_room is None:
                has_room = self.rate.has_room(now)
            if has_room:
                orders.append(Order(request, stream.shape, stream.key_due, stream.break_due))
            else:
                self.left_out += 1
        return orders

    def unit(self, order: Order, encoded: Encoded, now: float) -> Departure | None:
        """Returns the unit to send, and when; `now` uses the clock of `capture_us`. None: the stream is not watched,
        the picture is not the key picture that is due, or it is too large for the wire."""
        request = order.request
        stream = self._streams.get(request)
        if stream is None:
            return None
        if (stream.key_due and not encoded.key) or len(encoded.payload) > MAX_UNIT_BYTES - HEADER_BYTES:
            stream.key_due = True
            return None
        stream.key_due = stream.break_due = False
        sequence = self._sequences.get(request, 0)
        self._sequences[request] = (sequence + 1) & 0xFFFFFFFF
        message = encode_unit(
            Unit(
                quality=request.quality,
                codec=request.codec,
                sequence=sequence,
                key=encoded.key,
                is_break=encoded.is_break,
                capture_us=encoded.capture_us,
                width=encoded.width,
                height=encoded.height,
                rate_hz=order.shape.rate_hz,
                bits_per_s=order.shape.bits_per_s,
                held_ms=min(MAX_HELD_MS, max(0, round(now * 1000 - encoded.capture_us / 1000))),
                payload=encoded.payload,
            )
        )
        stream.overshoot.made(wire_bits(len(message)), order.shape.bits_per_s, now)
        return Departure(message, self.rate.sent(Got(request.quality, request.codec, sequence), len(message), now))
