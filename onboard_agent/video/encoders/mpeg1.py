"""MPEG-1 video in MPEG-TS, which every browser can show. Each picture's unit is ready when that picture is fed.

FFmpeg's MPEG-1 encoder holds one picture back, because a picture between two others may refer to the later one. We
never encode such pictures, and `low_delay` tells FFmpeg so. FFmpeg rejects that unless `strict` is `unofficial`, only
because MPEG-1 has no field to signal it to a decoder; the output is identical to the byte (`python -m bench encoder`).
"""

from fractions import Fraction
from typing import Final

from av.video.codeccontext import VideoCodecContext

from onboard_agent.video.encoders.encoder import EncodedPicture, EncoderBroken
from onboard_agent.video.encoders.picture_shape import Shape
from onboard_agent.video.encoders.pyav_encoder import Aim, PyavEncoder, new_context
from onboard_agent.video.encoders.transport_stream import TABLE_BYTES, TransportStream, room_for_picture
from onboard_agent.video.sources.source import Picture
from wire.video import Codec, QualityLimits

CODED_RATES_HZ: Final = (24, 25, 30, 50, 60)
"""Rates that the MPEG-1 header can state and JSMpeg can read. Slower streams state 24: each picture has a time."""

MAX_PICTURE_S: Final = 0.25
"""No picture is larger than what the bit rate yields in this time, so that a key picture does not delay those after it.
On a line of 1.5 times the bit rate the slowest 5 % take 45 ms instead of 450, at a cost of half a decibel."""

_MIN_PICTURE_BYTES: Final = 100
_NO_HOLD: Final = {"flags": "+low_delay", "strict": "unofficial"}
_KEY_AGAINST_OTHERS: Final = {"i_qfactor": "1.5"}
"""Key pictures are quantised more coarsely than others, not more finely as by default: later pictures repair the loss,
and fewer attempts are needed to stay within the bound."""


class Mpeg1Encoder(PyavEncoder):
    """MPEG-1 in MPEG-TS."""

    codec = Codec.MPEG1
    name = "mpeg1video"

    def __init__(self, limits: QualityLimits, bits_per_s: int | None = None) -> None:
        super().__init__(limits, bits_per_s)
        self._stream = TransportStream()

    def encode(self, picture: Picture, *, force_key: bool = False) -> list[EncodedPicture]:
        coded = super().encode(picture, force_key=force_key)
        if len(coded) != 1:
            self.close()
            raise EncoderBroken(f"{self.name} holds pictures back")
        return coded

    def _open(self, shape: Shape, aim: Aim) -> VideoCodecContext:
        rate_hz = coded_rate_hz(aim.rate_hz)
        bits = picture_bits(aim)
        context = new_context(self.name, shape, Fraction(rate_hz))
        context.pix_fmt = self.pixel_format
        context.bit_rate = bits * rate_hz
        largest = max(2 * bits, round(bits * aim.rate_hz * MAX_PICTURE_S))
        context.options = {**_NO_HOLD, **_KEY_AGAINST_OTHERS, "maxrate": str(context.bit_rate), "bufsize": str(largest)}
        context.open()
        return context

    def _pack(self, coded: bytes, context: VideoCodecContext, *, key: bool, capture_us: int) -> bytes:
        return self._stream.pack(coded, key=key, at_us=capture_us)


def coded_rate_hz(rate_hz: float) -> int:
    """The lowest rate that a header can state and that is not below `rate_hz`, or the highest one."""
    return next((rate for rate in CODED_RATES_HZ if rate >= rate_hz - 0.5), CODED_RATES_HZ[-1])


def picture_bits(aim: Aim) -> int:
    """Average bits per picture at which the units match the bit rate; the packets need some of it."""
    unit_bytes = (aim.bits_per_s / 8 - TABLE_BYTES) / aim.rate_hz
    return 8 * max(_MIN_PICTURE_BYTES, round(room_for_picture(unit_bytes)))
