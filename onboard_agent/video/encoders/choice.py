"""Finds out which encoders this machine has, by encoding a test picture and checking the result."""

import logging
from functools import cache
from typing import Final

import av
import numpy as np

from onboard_agent.video.encoders.encoder import EncodedPicture, Encoder, EncoderBroken
from onboard_agent.video.encoders.h264 import BY_HARDWARE, BY_PROCESSOR, H264Encoder, H264Kind
from onboard_agent.video.encoders.mpeg1 import Mpeg1Encoder
from onboard_agent.video.sources.source import Picture
from wire.video import LIMITS, Codec, Quality

_log = logging.getLogger(__name__)

_TEST_PICTURES: Final = 6
_MAX_HELD: Final = 1
"""An encoder that holds back more pictures than this is not used: the processor is faster then."""
_MAX_ERROR: Final = 8.0
"""Maximum mean error over the picture, of 255: the encoded picture has to look like the original."""


def make_encoder(codec: Codec, quality: Quality) -> Encoder:
    """Makes an encoder for this stream, at the quality's bit rate (H.264 at 0.6 of it). Raises EncoderBroken if the
    codec is not one of `usable_codecs`."""
    if codec is Codec.MPEG1:
        return Mpeg1Encoder(LIMITS[quality])
    kind = best_h264()
    if kind is None:
        raise EncoderBroken("this machine has no H.264 encoder")
    return H264Encoder(kind, LIMITS[quality])


def usable_codecs() -> tuple[Codec, ...]:
    """Codecs available on this machine. The first call may take a second."""
    return (Codec.MPEG1,) if best_h264() is None else (Codec.MPEG1, Codec.H264)


@cache
def best_h264() -> H264Kind | None:
    """The first encoder that works, hardware before the processor."""
    for kind in (*BY_HARDWARE, BY_PROCESSOR):
        problem = what_is_wrong(kind)
        if not problem:
            _log.info("H.264 by %s", kind.name)
            return kind
        _log.debug("H.264 not by %s: %s", kind.name, problem)
    return None


def what_is_wrong(kind: H264Kind) -> str:
    """Encodes a few pictures and decodes them. Returns the problem, or an empty string if it is usable."""
    encoder = H264Encoder(kind, LIMITS[Quality.MEDIUM])
    coded: list[EncodedPicture] = []
    try:
        for number in range(_TEST_PICTURES):
            picture = Picture(_test_picture(), (number + 1) * 40_000, number + 1, number == 0)
            coded += encoder.encode(picture, force_key=number == _TEST_PICTURES // 2)
    except EncoderBroken as error:
        return str(error)
    finally:
        encoder.close()
    if len(coded) < _TEST_PICTURES - _MAX_HELD:
        return f"of {_TEST_PICTURES} pictures it holds {_TEST_PICTURES - len(coded)} back"
    if not coded[0].key or sum(unit.key for unit in coded) < 2:
        return "it gives no key picture when it is asked to"
    return _inspect(coded)


def _inspect(coded: list[EncodedPicture]) -> str:
    decoder = av.VideoCodecContext.create("h264", "r")
    decoder.options = {"flags": "+low_delay"}
    decoder.thread_count = 1
    try:
        frames = [frame for unit in coded for frame in decoder.decode(av.Packet(unit.payload))]
        frames += decoder.decode(None)
        shown = frames[-1].to_ndarray(format="gray") if frames else np.zeros((1, 1))
    except av.FFmpegError as error:
        return f"what it makes cannot be decoded ({error})"
    given = _test_picture().to_ndarray(format="gray")
    if shown.shape != given.shape:
        return "what it makes has another shape"
    off_by = float(np.abs(shown.astype(float) - given).mean())
    return "" if off_by <= _MAX_ERROR else f"what it makes looks otherwise (by {off_by:.0f} of 255)"


def _test_picture() -> av.VideoFrame:
    """Ramps, so that a shifted, mirrored or single-coloured picture can be detected."""
    limits = LIMITS[Quality.MEDIUM]
    across = np.linspace(30, 220, limits.width)
    down = np.linspace(-14, 14, limits.height)
    luma = np.clip(across[None, :] + down[:, None], 16, 235).astype(np.uint8)
    return av.VideoFrame.from_ndarray(luma, format="gray").reformat(format="yuv420p")
