"""`python -m bench encoder`: the cost of encoding without picture delay, compared with plain MPEG-1 and known tricks.

All ways encode the same pictures with the same options in one run, taking turns in each round. No line, no process:
only the codec, in this thread's processor time. See docs/bench.md.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Final

import av
import cv2
import numpy as np
from av.video.frame import PictureType

from bench.rows import Report
from onboard_agent.video.encoders.h264 import BY_PROCESSOR, H264Encoder
from onboard_agent.video.encoders.mpeg1 import Mpeg1Encoder, coded_rate_hz
from onboard_agent.video.sources.source import Picture
from wire.video import LIMITS, Quality, QualityLimits

_GOP: Final = 24
_BOUND_S: Final = 0.25


@dataclass(frozen=True)
class Coded:
    """An encoded picture: its number, its size, and how many pictures had been fed by then."""

    number: int
    size: int
    after: int


@dataclass
class Found:
    """Results of one way, over the rounds."""

    cpu_ms: list[float] = field(default_factory=list)
    coded: list[Coded] = field(default_factory=list)
    off: float = 0.0


Way = Callable[[list[av.VideoFrame], QualityLimits], tuple[list[Coded], list[bytes], list[float]]]


async def run(report: Report, options: argparse.Namespace) -> None:
    rounds = options.rounds or (1 if options.quick else 5)
    count = 72 if options.quick else 480
    for quality in (Quality.MEDIUM, Quality.HIGH):
        limits = LIMITS[quality]
        frames = _flight(limits.width, limits.height, count)
        found = {name: Found() for name in WAYS}
        for number in range(rounds):
            for name, way in WAYS.items():
                coded, payloads, cpu_ms = way(frames, limits)
                found[name].cpu_ms += cpu_ms
                if number == 0:
                    found[name].coded = coded
                    found[name].off = _off(frames, coded, payloads, "h264" if "264" in name else "mpeg1video")
        for name, one in found.items():
            report.system = name
            _add_figures(report, f"{limits.width}x{limits.height} at {limits.rate_hz:g} Hz", one, limits.rate_hz, count)


def _add_figures(report: Report, case: str, one: Found, rate_hz: float, count: int) -> None:
    held = [coded.after - coded.number - 1 for coded in one.coded]
    report.add(case, "held back", max(held), "pictures")
    report.add(case, "held back, as time", max(held) / rate_hz * 1e3, "ms")
    report.add(case, "bit rate", sum(coded.size for coded in one.coded) * 8 * rate_hz / count / 1e3, "kbit/s")
    report.spread(case, "processor", one.cpu_ms, "ms a picture")
    report.add(case, "off by", one.off, "of 255, mean")


def _plain_context(limits: QualityLimits, rates: int, extra: dict[str, str]) -> av.VideoCodecContext:
    """Opened like the agent's encoder, except for `extra`. MPEG-1 has no 48 Hz: set to 50, it gets a proportionally
    higher bit rate."""
    rate = coded_rate_hz(limits.rate_hz * rates)
    bits_per_s = round(limits.bits_per_s * rate / (limits.rate_hz * rates))
    context = av.VideoCodecContext.create("mpeg1video", "w")
    context.width, context.height, context.pix_fmt = limits.width, limits.height, "yuv420p"
    context.framerate, context.time_base = Fraction(rate), Fraction(1, rate)
    context.bit_rate, context.gop_size, context.max_b_frames = bits_per_s, 9_999, 0
    context.thread_count = 1
    bound = {"maxrate": str(bits_per_s), "bufsize": str(round(bits_per_s * _BOUND_S))}
    context.options = {**bound, "i_qfactor": "1.5", **extra}
    return context


def _mpeg1(extra: dict[str, str], copies: int = 1, rates: int = 1) -> Way:
    """FFmpeg's own encoder. `copies`: how often each picture is fed. `rates`: factor of the configured rate over the
    camera's, for copies that are encoded."""

    def way(frames: list[av.VideoFrame], limits: QualityLimits) -> tuple[list[Coded], list[bytes], list[float]]:
        context = _plain_context(limits, rates, extra)
        payloads: list[bytes] = []
        sizes, after = [0] * len(frames), [0] * len(frames)
        cpu_ms = []
        for number, picture in enumerate(frames):
            begun = time.thread_time()
            for copy in range(copies):
                frame = picture.reformat(format="yuv420p", dst_color_range=1)
                frame.pts, frame.time_base = number * copies + copy, context.time_base
                frame.pict_type = PictureType.I if number % _GOP == 0 and copy == 0 else PictureType.NONE
                for packet in context.encode(frame):
                    _note(packet, copies, number + 1, sizes, after, payloads)
            cpu_ms.append((time.thread_time() - begun) * 1e3)
        for packet in context.encode(None):
            _note(packet, copies, len(frames) + 1, sizes, after, payloads)
        coded = [Coded(number, *one) for number, one in enumerate(zip(sizes, after, strict=True))]
        return coded, payloads, cpu_ms

    return way


def _note(
    packet: av.Packet[Any], copies: int, fed: int, sizes: list[int], after: list[int], payloads: list[bytes]
) -> None:
    assert packet.pts is not None
    number, copy = divmod(packet.pts, copies)
    sizes[number] += packet.size
    if copy == 0:
        after[number] = fed
    payloads.append(bytes(packet))


def _ours(make: Callable[[QualityLimits], Mpeg1Encoder | H264Encoder]) -> Way:
    """The agent's encoder, with its key pictures, its packets and its own copy of the picture."""

    def way(frames: list[av.VideoFrame], limits: QualityLimits) -> tuple[list[Coded], list[bytes], list[float]]:
        encoder = make(limits)
        coded, payloads, cpu_ms = [], [], []
        for number, frame in enumerate(frames):
            picture = Picture(frame, 1_000_000 + round(number * 1e6 / limits.rate_hz), number + 1, number == 0)
            begun = time.thread_time()
            (unit,) = encoder.encode(picture)
            cpu_ms.append((time.thread_time() - begun) * 1e3)
            coded.append(Coded(number, len(unit.payload), number + 1))
            payloads.append(unit.payload if isinstance(encoder, H264Encoder) else _picture_in(unit.payload))
        return coded, payloads, cpu_ms

    return way


def _picture_in(unit: bytes) -> bytes:
    """Returns the PES payload of a unit's packets."""
    pes = b""
    for at in range(0, len(unit), 188):
        packet = unit[at : at + 188]
        if packet[1] & 0x1F == 1 and packet[2] == 0:
            pes += packet[5 + packet[4] :] if packet[3] & 0x20 else packet[4:]
    return pes[9 + pes[8] :]


_NO_HOLD: Final = {"flags": "+low_delay", "strict": "unofficial"}

WAYS: Final[dict[str, Way]] = {
    "plain MPEG-1": _mpeg1({}),
    "fed twice, copy coded": _mpeg1({}, copies=2, rates=2),
    "low_delay": _mpeg1(_NO_HOLD),
    "ours, MPEG-1 in TS": _ours(Mpeg1Encoder),
    "ours, H.264": _ours(lambda limits: H264Encoder(BY_PROCESSOR, limits)),
}


def _off(frames: list[av.VideoFrame], coded: list[Coded], payloads: list[bytes], codec: str) -> float:
    """Returns the average difference between decoded and original pictures; infinite if pictures are missing."""
    decoder = av.VideoCodecContext.create(codec, "r")
    assert isinstance(decoder, av.VideoCodecContext)
    decoder.options, decoder.thread_count = {"flags": "+low_delay"}, 1
    shown = [frame for payload in payloads for frame in decoder.decode(av.Packet(payload))]
    copies = len(shown) // len(coded)
    if not shown or len(shown) != copies * len(coded):
        return float("inf")
    height = frames[0].height
    offs = [
        np.abs(one.to_ndarray()[:height].astype(int) - other.to_ndarray()[:height]).mean()
        for one, other in zip(shown[::copies], frames, strict=True)
    ]
    return float(np.mean(offs))


def _flight(width: int, height: int, count: int) -> list[av.VideoFrame]:
    """Generates turning, sliding ground, with detail of every size and a little noise."""
    random = np.random.default_rng(7)
    noise = random.normal(128, 60, (height * 2, width * 3)).astype(np.float32)
    texture = np.sum([cv2.GaussianBlur(noise, (0, 0), size) * size for size in (1, 3, 9, 27)], axis=0)
    ground = ((texture - texture.min()) / np.ptp(texture) * 219 + 16).astype(np.uint8)
    frames = []
    for number in range(count):
        x, y = width * (1 + 0.8 * np.sin(number / 60)), height * (0.5 + 0.4 * np.sin(number / 47))
        turn = cv2.getRotationMatrix2D((x + width / 2, y + height / 2), 8 * np.sin(number / 30), 1.0)
        turn[:, 2] -= (x, y)
        seen = cv2.warpAffine(ground, turn, (width, height), borderMode=cv2.BORDER_REFLECT).astype(np.int16)
        planes = np.full((height * 3 // 2, width), 128, np.uint8)
        planes[:height] = np.clip(seen + random.integers(-3, 4, seen.shape, dtype=np.int16), 16, 235)
        frames.append(av.VideoFrame.from_ndarray(planes, format="yuv420p"))
    return frames
