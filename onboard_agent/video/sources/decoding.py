"""Decoders without buffering, and FFmpeg's errors as text."""

from typing import Final

import av
from av.container import InputContainer
from av.video.codeccontext import VideoCodecContext

from onboard_agent.video.sources.picture_size import MAX_PIXELS, MAX_TEXT_LENGTH, TooLarge, check_size, jpeg_size
from onboard_agent.video.sources.source import CameraLost

SIZE_BOUND: Final = {"max_pixels": str(MAX_PIXELS)}
"""Option for FFmpeg, which then refuses larger pictures before it allocates memory for them."""


def hold_nothing(context: VideoCodecContext) -> None:
    """Call before the first packet: each packet then gives its picture at once, without a delay of one per CPU core."""
    context.thread_count = 1
    context.options = {"flags": "+low_delay", **SIZE_BOUND}


class JpegDecoder:
    """Decodes single JPEG pictures."""

    def __init__(self) -> None:
        self._context = VideoCodecContext.create("mjpeg", "r")
        hold_nothing(self._context)

    def decode(self, jpeg: bytes) -> av.VideoFrame | None:
        """Returns None if the JPEG is damaged, as some pictures of cheap cameras are. Raises TooLarge."""
        size = jpeg_size(jpeg)
        if size is not None:  # otherwise the decoder may understand it, and it refuses larger pictures too
            check_size(*size)
        try:
            frames = self._context.decode(av.Packet(jpeg))
        except av.FFmpegError:
            return None
        return frames[0] if frames else None


def check_stream(name: str, container: InputContainer) -> None:
    """Checks that there are pictures of an accepted size. Raises CameraLost."""
    if not container.streams.video:
        raise CameraLost(f"{name}: has no pictures")
    context = container.streams.video[0].codec_context
    try:
        check_size(context.width, context.height)
    except TooLarge as error:
        raise CameraLost(f"{name}: {error}") from None


def lost_while_decoding(name: str, error: Exception) -> CameraLost:
    """Like `lost`. If FFmpeg learns the size only from the first picture, it refuses a large one at this point."""
    if isinstance(error, av.ArgumentError):
        return CameraLost(f"{name}: its pictures cannot be decoded, or are too large: the most is {MAX_TEXT_LENGTH}")
    return lost(name, error)


def lost(name: str, error: Exception) -> CameraLost:
    """Formats an error of PyAV with the camera's name, without FFmpeg's address, which may contain passwords."""
    if isinstance(error, av.ExitError):  # PyAV's error for a timeout
        return CameraLost(f"{name}: sends nothing")
    if isinstance(error, av.FFmpegError):
        return CameraLost(f"{name}: {error.strerror}")
    return CameraLost(f"{name}: {error}")
