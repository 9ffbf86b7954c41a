"""Decoders that hold nothing back, and FFmpeg's errors as words."""

from typing import Final

import av
from av.container import InputContainer
from av.video.codeccontext import VideoCodecContext

from onboard_agent.video.sources.picture_size import MAX_PIXELS, MAX_TEXT_LENGTH, TooLarge, check_size, jpeg_size
from onboard_agent.video.sources.source import CameraLost

SIZE_BOUND: Final = {"max_pixels": str(MAX_PIXELS)}
"""For FFmpeg, which refuses what is larger before it takes memory for it."""


def hold_nothing(context: VideoCodecContext) -> None:
    """To be called before the first packet: a picture for each packet, instead of one for each processor later."""
    context.thread_count = 1
    context.options = {"flags": "+low_delay", **SIZE_BOUND}


class JpegDecoder:
    """JPEG to pictures, one by one."""

    def __init__(self) -> None:
        self._context = VideoCodecContext.create("mjpeg", "r")
        hold_nothing(self._context)

    def decode(self, jpeg: bytes) -> av.VideoFrame | None:
        """None: it is damaged, as the odd picture of a cheap camera is. Raises TooLarge."""
        size = jpeg_size(jpeg)
        if size is not None:  # else the decoder may understand it, and takes nothing larger either
            check_size(*size)
        try:
            frames = self._context.decode(av.Packet(jpeg))
        except av.FFmpegError:
            return None
        return frames[0] if frames else None


def check_stream(name: str, container: InputContainer) -> None:
    """That there are pictures, of a size that is taken. Raises CameraLost."""
    if not container.streams.video:
        raise CameraLost(f"{name}: has no pictures")
    context = container.streams.video[0].codec_context
    try:
        check_size(context.width, context.height)
    except TooLarge as error:
        raise CameraLost(f"{name}: {error}") from None


def lost_while_decoding(name: str, error: Exception) -> CameraLost:
    """As `lost`. If FFmpeg did not know the size before the first picture, it refuses it there."""
    if isinstance(error, av.ArgumentError):
        return CameraLost(f"{name}: its pictures cannot be decoded, or are too large: the most is {MAX_TEXT_LENGTH}")
    return lost(name, error)


def lost(name: str, error: Exception) -> CameraLost:
    """`error` of PyAV as one line with the camera's name, without the address that FFmpeg adds: passwords are in it."""
    if isinstance(error, av.ExitError):  # PyAV's way to say that the time is up
        return CameraLost(f"{name}: sends nothing")
    if isinstance(error, av.FFmpegError):
        return CameraLost(f"{name}: {error.strerror}")
    return CameraLost(f"{name}: {error}")
