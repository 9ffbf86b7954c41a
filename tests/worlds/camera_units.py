"""Video units as an agent sends them. Each picture shows its own number."""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from io import BytesIO
from typing import Any

import av
import numpy as np
from av.video.frame import VideoFrame

from wire.video import Codec, Quality, Unit, encode_unit

CELLS = 12
"""Number of bits in the picture's number. They are black or white cells across its upper half."""


def picture(number: int, width: int = 320, height: int = 240) -> VideoFrame:
    """Returns a grey picture with its number as bits in the upper half and a moving shape below."""
    pixels = np.full((height, width, 3), 90, np.uint8)
    for bit in range(CELLS):
        left, right = bit * width // CELLS, (bit + 1) * width // CELLS
        pixels[: height // 2, left:right] = 235 if number >> (CELLS - 1 - bit) & 1 else 16
    at = number * 7 % (width - 20)
    pixels[height * 3 // 4 :, at : at + 20] = (200, 40, 40)
    return VideoFrame.from_ndarray(pixels, format="rgb24")


def number_in(frame: VideoFrame) -> int:
    """Reads the number that `picture` drew, also after scaling and coding."""
    light = frame.to_ndarray(format="gray")
    row = light[light.shape[0] // 4]
    bits = [row[(2 * bit + 1) * len(row) // (2 * CELLS)] > 125 for bit in range(CELLS)]
    return int("".join("01"[bool(bit)] for bit in bits), 2)


def _packets(frames: Sequence[VideoFrame], codec: Codec, group: int, preset: str) -> Iterator[tuple[bool, bytes]]:
    """Yields (key, payload) for each picture."""
    target = BytesIO()
    options: dict[str, str] = {}
    if codec is Codec.MPEG1:
        container: Any = av.open(
            target, "w", format="mpegts", options={"flush_packets": "1", "omit_video_pes_length": "0"}
        )
        stream = container.add_stream("mpeg1video", rate=25)
    else:
        container = None
        options = {"preset": preset, "tune": "zerolatency", "x264-params": "repeat-headers=1:annexb=1"}
        stream = None
    context = stream.codec_context if stream is not None else av.CodecContext.create("libx264", "w")
    context.width, context.height, context.pix_fmt = frames[0].width, frames[0].height, "yuv420p"
    context.bit_rate, context.gop_size, context.max_b_frames = 800_000, group, 0
    context.thread_count = 1
    context.options = options
    context.time_base = Fraction(1, 25)
    context.framerate = Fraction(25)
    for pts, frame in enumerate([*frames, None]):
        if frame is not None:
            frame = frame.reformat(format="yuv420p")
            frame.pts, frame.time_base = pts, Fraction(1, 25)
        for packet in context.encode(frame):
            key = packet.is_keyframe
            if container is None:
                yield key, bytes(packet)
                continue
            packet.stream = stream
            begun = target.tell()
            container.mux(packet)
            yield key, target.getvalue()[begun:]
    if container is not None:
        container.close()


def units(
    codec: Codec,
    capture_us: Sequence[int],
    *,
    width: int = 320,
    height: int = 240,
    rate_hz: int = 24,
    group: int = 12,
    first_number: int = 0,
    first_sequence: int = 0,
    is_break: bool = False,
    quality: Quality = Quality.MEDIUM,
    preset: str = "ultrafast",
) -> list[bytes]:
    """Returns one message per capture time. The pictures are numbered from `first_number`."""
    frames = [picture(first_number + number, width, height) for number in range(len(capture_us))]
    made = []
    for number, (key, payload) in enumerate(_packets(frames, codec, group, preset)):
        made.append(
            encode_unit(
                Unit(
                    quality=quality,
                    codec=codec,
                    sequence=first_sequence + number,
                    key=key,
                    is_break=is_break and number == 0,
                    capture_us=capture_us[number],
                    width=width,
                    height=height,
                    rate_hz=rate_hz,
                    bits_per_s=800_000,
                    held_ms=3,
                    payload=payload,
                )
            )
        )
    assert len(made) == len(capture_us)
    return made
