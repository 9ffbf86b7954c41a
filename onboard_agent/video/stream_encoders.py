"""The encoders, in their worker thread: one for each stream, created at its first picture.

All methods except the constructor are called in one worker thread.
"""

import logging
from collections.abc import Callable, Iterable
from typing import Final

from onboard_agent.video.core.streaming import Encoded, Order
from onboard_agent.video.encoders.encoder import Encoder, EncoderBroken
from onboard_agent.video.sources.source import Picture
from wire.video import Codec, Quality, StreamRequest

_log = logging.getLogger(__name__)

MakeEncoder = Callable[[Codec, Quality], Encoder]
Done = Callable[[Order, Encoded], None]
Broken = Callable[[Order, str], None]

NOTICEABLE: Final = 0.06
"""Smaller changes of the bit rate do not retune the encoder."""


class StreamEncoders:
    """`done`, `broken`: called in the worker thread as soon as each picture is ready or has failed."""

    def __init__(self, make_encoder: MakeEncoder, done: Done, broken: Broken) -> None:
        self._make_encoder = make_encoder
        self._done = done
        self._broken = broken
        self._encoders: dict[StreamRequest, Encoder] = {}
        self._tuned: dict[StreamRequest, tuple[int, float, float]] = {}

    def encode(self, picture: Picture, orders: Iterable[Order]) -> None:
        """Encodes one picture for each stream that takes it."""
        for order in orders:
            try:
                encoder = self._encoder(order)
                taken = picture._replace(is_break=order.is_break)
                made = encoder.encode(taken, force_key=order.force_key)
            except EncoderBroken as error:
                self.drop([order.request])
                self._broken(order, str(error))
                continue
            for one in made:
                self._done(order, Encoded(one.payload, one.key, one.width, one.height, one.capture_us, one.is_break))

    def _encoder(self, order: Order) -> Encoder:
        request, shape = order.request, order.shape
        encoder = self._encoders.get(request)
        if encoder is None:
            encoder = self._encoders[request] = self._make_encoder(request.codec, request.quality)
            _log.info("video: %s %s by %s", request.quality.name.lower(), request.codec.name, encoder.name)
        bits_before, *rest_before = self._tuned.get(request, (0, 0.0, 0.0))
        if [shape.rate_hz, shape.scale] != rest_before or abs(shape.bits_per_s - bits_before) > (
            NOTICEABLE * bits_before
        ):
            encoder.retune(bits_per_s=shape.bits_per_s, rate_hz=shape.rate_hz, scale=shape.scale)
            self._tuned[request] = (shape.bits_per_s, shape.rate_hz, shape.scale)
        return encoder

    def keep(self, requests: Iterable[StreamRequest]) -> None:
        """Drops the encoders of all other streams."""
        kept = set(requests)
        self.drop([request for request in self._encoders if request not in kept])

    def drop(self, requests: Iterable[StreamRequest]) -> None:
        """Closes the encoders of these streams."""
        for request in requests:
            self._tuned.pop(request, None)
            encoder = self._encoders.pop(request, None)
            if encoder is not None:
                encoder.close()
