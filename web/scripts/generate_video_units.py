"""Writes web/test/golden/video_units.json: units as the agent makes them, and what FFmpeg's decoders make of them.

The player's decoders are held against it (web/test/video/). Run it after a change of the unit or of an encoder:

    .venv/bin/python web/scripts/generate_video_units.py
"""

import base64
import io
import json
from pathlib import Path
from typing import Any, Final

import av
import numpy as np

from onboard_agent.video.encoders.encoder import EncodedPicture
from onboard_agent.video.encoders.h264 import BY_PROCESSOR, H264Encoder
from onboard_agent.video.encoders.mpeg1 import Mpeg1Encoder
from onboard_agent.video.sources.source import Picture
from wire.video import Codec, Quality, QualityLimits, Unit, encode_unit

GOLDEN: Final = Path(__file__).resolve().parent.parent / "test" / "golden" / "video_units.json"
# Neither a multiple of 16: what is coded is larger than what is shown.
SMALL: Final = QualityLimits(120, 68, 24.0, 400_000, 60_000)
SMALLER: Final = QualityLimits(72, 40, 24.0, 200_000, 60_000)
PICTURES: Final = 8
COMPARED: Final = (0, 1, 5, 6, 7)


def scene(number: int, width: int, height: int) -> av.VideoFrame:
    """Colours that move, a hard edge, noise: motion, both kinds of blocks, and values at both ends."""
    noise = np.random.default_rng(number)
    down, across = np.mgrid[0:height, 0:width]
    rgb = np.zeros((height, width, 3), np.uint8)
    rgb[..., 0] = (across * 3 + number * 9) % 256
    rgb[..., 1] = (down * 5 + number * 4) % 256
    rgb[..., 2] = 255 * ((across + 2 * number) // 24 % 2)
    rgb[8:24, 8 + 4 * number : 28 + 4 * number] = noise.integers(0, 256, (16, 20, 1))
    return av.VideoFrame.from_ndarray(rgb, format="rgb24")


def stream(encoder: Mpeg1Encoder | H264Encoder, limits: QualityLimits, first_sequence: int) -> list[dict[str, Any]]:
    coded = []
    for number in range(PICTURES):
        picture = Picture(scene(number, limits.width, limits.height), 1_000_000 + number * 41_667, number + 1, False)
        coded += encoder.encode(picture, force_key=number == PICTURES - 2)
    encoder.close()
    codec = encoder.codec
    decoder = av.VideoCodecContext.create("mpeg1video" if codec is Codec.MPEG1 else "h264", "r")
    decoder.options = {"flags": "+low_delay"}
    decoder.thread_count = 1
    frames = [frame for packet in packets(codec, coded) for frame in decoder.decode(packet)]
    frames += decoder.decode(None)
    assert len(frames) == len(coded) == PICTURES
    units = []
    for number, (one, frame) in enumerate(zip(coded, frames, strict=True)):
        unit = Unit(
            Quality.MEDIUM,
            codec,
            (first_sequence + number) % 2**32,
            one.key,
            one.is_break,
            one.capture_us,
            one.width,
            one.height,
            limits.rate_hz,
            limits.bits_per_s,
            3,
            one.payload,
        )
        planes = frame.to_ndarray(format="yuv420p").tobytes()
        assert len(planes) == one.width * one.height * 3 // 2
        units.append({"unit": text(encode_unit(unit)), "planes": text(planes) if number in COMPARED else ""})
    return units


def packets(codec: Codec, coded: list[EncodedPicture]) -> list[av.Packet]:
    """The elementary stream, by FFmpeg's own demuxer."""
    if codec is Codec.H264:
        return [av.Packet(one.payload) for one in coded]
    with av.open(io.BytesIO(b"".join(one.payload for one in coded)), format="mpegts") as container:
        return [av.Packet(bytes(packet)) for packet in container.demux(video=0) if packet.size]


def text(data: bytes) -> str:
    return base64.b64encode(data).decode()


def main() -> None:
    streams = {
        "mpeg1": stream(Mpeg1Encoder(SMALL), SMALL, 2**32 - 3),
        "mpeg1_smaller": stream(Mpeg1Encoder(SMALLER), SMALLER, 0),
        "h264": stream(H264Encoder(BY_PROCESSOR, SMALL), SMALL, 0),
    }
    GOLDEN.write_text(json.dumps(streams) + "\n")


if __name__ == "__main__":
    main()
