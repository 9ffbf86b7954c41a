"""MPEG-1 video in MPEG-TS: what every browser can show, and the unit of each picture when that picture is fed.

FFmpeg's MPEG-1 encoder holds one picture back, because a picture between two others may point to the later one. We
never code such pictures, and `low_delay` tells it so. It is refused unless the compliance is `unofficial`, for the only
reason that MPEG-1 has no field to tell a decoder; what is coded is the same to the byte (`python -m bench encoder`).
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
"""Rates that an MPEG-1 header can express and JSMpeg can read. Slower streams say 24: each picture has a time."""

MAX_PICTURE_S: Final = 0.25
"""No picture is larger than the bit rate gives in this time: a key picture must not hold up those behind it. On a line
of 1.5 times the bit rate the slowest 5 % take 45 ms instead of 450, and it costs half a decibel."""

_MIN_PICTURE_BYTES: Final = 100
_NO_HOLD: Final = {"flags": "+low_delay", "strict": "unofficial"}
_KEY_AGAINST_OTHERS: Final = {"i_qfactor": "1.5"}
"""Key pictures are quantised more coarsely than the others, not more finely as by default: those after them repair it,
and fewer attempts are needed to keep within the bound."""


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
    """The lowest rate of a header that is not below `rate_hz`, or the highest."""
    return next((rate for rate in CODED_RATES_HZ if rate >= rate_hz - 0.5), CODED_RATES_HZ[-1])


def picture_bits(aim: Aim) -> int:
    """How many bits a picture may have on average, so that the units come to the bit rate: the packets cost some."""
    unit_bytes = (aim.bits_per_s / 8 - TABLE_BYTES) / aim.rate_hz
    return 8 * max(_MIN_PICTURE_BYTES, round(room_for_picture(unit_bytes)))
