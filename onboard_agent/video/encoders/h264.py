"""H.264, baseline, Annex B: by the processor (libx264), or by hardware that passes the test."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Final

import av
from av.codec.hwaccel import HWAccel
from av.video.codeccontext import VideoCodecContext

from onboard_agent.video.core.allotment import SHARE_OF_MPEG1
from onboard_agent.video.encoders.annex_b import IDR, nal_types, with_parameter_sets
from onboard_agent.video.encoders.picture_shape import Shape
from onboard_agent.video.encoders.pyav_encoder import Aim, PyavEncoder, new_context
from wire.video import Codec, QualityLimits


@dataclass(frozen=True)
class H264Kind:
    """One H.264 encoder of FFmpeg: its FFmpeg name, its pixel format and options, and whether the bit rate can be
    lowered while it is open."""

    name: str
    pixel_format: str = "yuv420p"
    options: Mapping[str, str] = field(default_factory=dict)
    takes_bit_rate: bool = False
    bounds_pictures: bool = False
    """Whether it supports `maxrate` and `bufsize`."""
    device: str = ""
    """The device type whose memory the pictures must be in, if any."""


BY_PROCESSOR: Final = H264Kind(
    "libx264",
    options={
        "preset": "superfast",
        "tune": "zerolatency",
        "profile": "baseline",
        "forced-idr": "1",
        "sc_threshold": "0",
    },
    takes_bit_rate=True,
    bounds_pictures=True,
)

BY_HARDWARE: Final = (
    H264Kind("h264_v4l2m2m", options={"num_output_buffers": "4", "num_capture_buffers": "4"}),
    H264Kind(
        "h264_vaapi",
        "nv12",
        {"async_depth": "1", "profile": "constrained_baseline"},
        bounds_pictures=True,
        device="vaapi",
    ),
    H264Kind(
        "h264_nvenc",
        options={
            "preset": "p1",
            "tune": "ull",
            "profile": "baseline",
            "rc": "cbr",
            "zerolatency": "1",
            "delay": "0",
            "forced-idr": "1",
        },
        bounds_pictures=True,
    ),
    H264Kind(
        "h264_qsv",
        "nv12",
        {"preset": "veryfast", "profile": "baseline", "async_depth": "1", "low_delay_brc": "1", "forced_idr": "1"},
        bounds_pictures=True,
    ),
    H264Kind(
        "h264_amf",
        "nv12",
        {"usage": "ultralowlatency", "profile": "constrained_baseline", "forced_idr": "1"},
        bounds_pictures=True,
    ),
)
"""In the order of the attempts."""

MAX_PICTURE_S: Final = 0.15
"""No picture is larger than what the bit rate yields in this time. Less than for MPEG-1, because libx264 fills it."""


class H264Encoder(PyavEncoder):
    """H.264 in Annex B, with the parameter sets at each key picture."""

    codec = Codec.H264

    def __init__(self, kind: H264Kind, limits: QualityLimits) -> None:
        super().__init__(limits, round(limits.bits_per_s * SHARE_OF_MPEG1[Codec.H264]))
        self._kind = kind
        self.name = kind.name
        self.pixel_format = kind.pixel_format
        self.forces_keys = not kind.device  # PyAV drops the key request on the way to the device

    def _open(self, shape: Shape, aim: Aim) -> VideoCodecContext:
        device = self._kind.device
        rate = Fraction(aim.rate_hz).limit_denominator(100)
        context = new_context(self.name, shape, rate, HWAccel(device) if device else None)
        if device:
            context.pix_fmt, context.sw_format = device, self.pixel_format
        else:
            context.pix_fmt = self.pixel_format
        context.bit_rate = aim.bits_per_s
        options = dict(self._kind.options)
        if self._kind.bounds_pictures:
            largest = max(2 * aim.bits_per_s / aim.rate_hz, aim.bits_per_s * MAX_PICTURE_S)
            options |= {"maxrate": str(aim.bits_per_s), "bufsize": str(round(largest))}
        context.options = options
        context.open()
        return context

    def _is_key(self, packet: av.Packet[Any], coded: bytes) -> bool:
        """Checks for IDR: FFmpeg also marks pictures as key from which a decoder recovers only after a while."""
        return IDR in nal_types(coded)

    def _retuned(self, context: VideoCodecContext, was: Aim) -> None:
        """Lowers the rate at once; raises it only at the next key picture, together with its bound."""
        bits = round(self._aim.bits_per_s * was.rate_hz / self._aim.rate_hz)
        if self._kind.takes_bit_rate and bits < (context.bit_rate or 0):
            context.bit_rate = bits

    def _pack(self, coded: bytes, context: VideoCodecContext, *, key: bool, capture_us: int) -> bytes:
        return with_parameter_sets(coded, context.extradata or b"") if key else coded
