"""Decoders that hold nothing back, and FFmpeg's errors as words."""

import av
from av.video.codeccontext import VideoCodecContext

from onboard_agent.video.sources.source import CameraLost


def hold_nothing(context: VideoCodecContext) -> None:
    """To be called before the first packet: a picture for each packet, instead of one for each processor later."""
    context.thread_count = 1
    context.options = {"flags": "+low_delay"}


class JpegDecoder:
    """JPEG to pictures, one by one."""

    def __init__(self) -> None:
        self._context = VideoCodecContext.create("mjpeg", "r")
        hold_nothing(self._context)

    def decode(self, jpeg: bytes) -> av.VideoFrame | None:
        """None: it is damaged, as the odd picture of a cheap camera is."""
        try:
            frames = self._context.decode(av.Packet(jpeg))
        except av.FFmpegError:
            return None
        return frames[0] if frames else None


def lost(name: str, error: Exception) -> CameraLost:
    """`error` of PyAV as one line with the camera's name, without the address that FFmpeg adds: passwords are in it."""
    if isinstance(error, av.ExitError):  # PyAV's way to say that the time is up
        return CameraLost(f"{name}: sends nothing")
    if isinstance(error, av.FFmpegError):
        return CameraLost(f"{name}: {error.strerror}")
    return CameraLost(f"{name}: {error}")
