"""Common part of all encoders: one codec at a time, reopened at a key picture after a change.

Key pictures follow the camera's clock, not a picture count, because pictures that are not sent are not encoded. For the
same reason the codec gets a count as its time: each picture then gets the same share of the bit rate, however many are
skipped, and never more because others are missing.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from fractions import Fraction
from typing import Any, Final, NamedTuple

import av
from av.codec.hwaccel import HWAccel
from av.video.codeccontext import VideoCodecContext
from av.video.frame import PictureType
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc, Interpolation

from onboard_agent.video.encoders.encoder import EncodedPicture, EncoderBroken
from onboard_agent.video.encoders.picture_shape import Shape, coded_shape
from onboard_agent.video.sources.source import Picture
from wire.video import Codec, QualityLimits

KEY_EVERY_US: Final = 1_000_000
"""A viewer who joins, or has lost data, waits no longer than this for a picture."""

SMPTE170M_MATRIX: Final = 6
"""The BT.601 matrix as streams name it. PyAV's constant (ITU601, 5) has the same coefficients under another name."""


class Aim(NamedTuple):
    """Target of an encoder."""

    bits_per_s: int
    rate_hz: float
    scale: float


class _Opened(NamedTuple):
    context: VideoCodecContext
    aim: Aim
    source: Shape
    shape: Shape


class _Fed(NamedTuple):
    capture_us: int
    is_break: bool


class PyavEncoder(ABC):
    """One stream. The subclass opens the codec and packs its output."""

    codec: Codec
    name: str
    pixel_format = "yuv420p"
    forces_keys = True
    """Whether an open codec accepts a request for a key picture; otherwise it is reopened for each."""

    def __init__(self, limits: QualityLimits, bits_per_s: int | None = None) -> None:
        self._limits = limits
        self._aim = Aim(bits_per_s or limits.bits_per_s, limits.rate_hz, 1.0)
        self._opened: _Opened | None = None
        self._count = 0
        self._key_due_us = 0
        self._waiting: dict[int, _Fed] = {}

    @abstractmethod
    def _open(self, shape: Shape, aim: Aim) -> VideoCodecContext:
        """Returns a codec ready for its first picture. Raises av.FFmpegError or ValueError."""

    @abstractmethod
    def _pack(self, coded: bytes, context: VideoCodecContext, *, key: bool, capture_us: int) -> bytes:
        """Returns the payload of the unit."""

    def _is_key(self, packet: av.Packet[Any], coded: bytes) -> bool:
        """Whether decoding can begin at this packet."""
        return packet.is_keyframe

    def _retuned(self, context: VideoCodecContext, was: Aim) -> None:  # noqa: B027 - most can do nothing
        """Applies those changes that an open codec supports."""

    def retune(self, *, bits_per_s: int, rate_hz: float, scale: float = 1.0) -> None:
        """See Encoder. Raises ValueError for values out of range."""
        if not (bits_per_s > 0 and rate_hz > 0 and 0 < scale <= 1):
            raise ValueError(f"cannot aim at {bits_per_s} bit/s, {rate_hz} Hz, {scale} of the size")
        was, self._aim = self._aim, Aim(bits_per_s, rate_hz, scale)
        if self._opened is not None:
            self._retuned(self._opened.context, was)

    def encode(self, picture: Picture, *, force_key: bool = False) -> list[EncodedPicture]:
        """See Encoder."""
        source = Shape(picture.frame.width, picture.frame.height)
        at_us = picture.capture_us
        opened = self._opened
        key = force_key or picture.is_break or opened is None or opened.source != source or at_us >= self._key_due_us
        coded: list[EncodedPicture] = []
        try:
            if key:
                self._key_due_us = at_us + KEY_EVERY_US
                if opened is not None and (opened.aim != self._aim or opened.source != source or not self.forces_keys):
                    coded += self._flush(opened)
                    opened = None
            if opened is None:
                shape = coded_shape(source, self._limits, self._aim.scale)
                opened = self._opened = _Opened(self._open(shape, self._aim), self._aim, source, shape)
            frame = self._as_coded(picture.frame, opened.shape)
            frame.pts = self._count
            frame.time_base = opened.context.time_base
            frame.pict_type = PictureType.I if key else PictureType.NONE
            self._waiting[self._count] = _Fed(at_us, picture.is_break)
            self._count += 1
            coded += self._take(opened, opened.context.encode(frame))
        except (av.FFmpegError, ValueError) as error:
            self.close()
            reason = error.strerror if isinstance(error, av.FFmpegError) else error
            raise EncoderBroken(f"{self.name}: {reason}") from error
        return coded

    def close(self) -> None:
        """See Encoder."""
        self._opened = None
        self._waiting.clear()

    def _as_coded(self, frame: av.VideoFrame, shape: Shape) -> av.VideoFrame:
        """A private frame in the encoded size and pixel format, black 16 and white 235."""
        ours = frame.reformat(
            width=shape.width,
            height=shape.height,
            format=self.pixel_format,
            dst_colorspace=Colorspace.ITU601,
            dst_color_range=ColorRange.MPEG,
            interpolation=Interpolation.AREA,
        )
        if ours is frame:  # nothing to convert, but other encoders may use the same frame, and this one is modified
            ours = av.VideoFrame.from_ndarray(frame.to_ndarray(), format=frame.format.name)
        return ours

    def _flush(self, opened: _Opened) -> list[EncodedPicture]:
        """Returns the pictures still held by a codec that is about to be closed."""
        coded = self._take(opened, opened.context.encode(None))
        self._waiting.clear()
        return coded

    def _take(self, opened: _Opened, packets: list[av.Packet[Any]]) -> list[EncodedPicture]:
        coded = []
        for packet in packets:
            fed = self._waiting.pop(packet.pts, None) if packet.pts is not None else None
            if fed is None:
                raise EncoderBroken(f"{self.name} gives a picture that it was not given")
            bits = bytes(packet)
            key = self._is_key(packet, bits)
            payload = self._pack(bits, opened.context, key=key, capture_us=fed.capture_us)
            coded.append(EncodedPicture(payload, key, *opened.shape, *fed))
        return coded


def new_context(codec: str, shape: Shape, rate: Fraction, hardware: HWAccel | None = None) -> VideoCodecContext:
    """Returns an unopened codec for this picture rate, without reordering of pictures. Raises av.FFmpegError or
    ValueError."""
    context = VideoCodecContext.create(codec, "w", hardware)
    assert isinstance(context, VideoCodecContext)
    context.width, context.height = shape
    context.framerate = rate
    context.time_base = 1 / rate
    context.gop_size = 9_999  # the camera's clock decides
    context.max_b_frames = 0
    context.thread_count = 1
    # The format that _as_coded produces. H.264 can state it, so that no decoder has to guess by the size.
    context.color_range = ColorRange.MPEG
    context.color_primaries = ColorPrimaries.SMPTE170M
    context.color_trc = ColorTrc.SMPTE170M
    context.colorspace = SMPTE170M_MATRIX
    return context
