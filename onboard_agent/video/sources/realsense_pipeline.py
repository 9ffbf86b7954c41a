"""The pipeline of librealsense (pyrealsense2): opens streams of a device or a recording, and aligns depth with
colour."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from onboard_agent.video.sources.mode import Mode
from onboard_agent.video.sources.realsense_device import Failed
from onboard_agent.video.sources.realsense_streams import Stream, Where

MISSING: Final = "pyrealsense2 is not installed (pip install 'control-tower-agent[realsense]'; for ARM see the manual)"
_USUAL: Final = Mode(640, 480, 30)
"""Every model of the D400 series has it for all streams."""


def library() -> Any:
    """Returns the module. Raises Failed where it is not installed."""
    try:
        import pyrealsense2
    except ImportError:
        raise Failed(MISSING) from None
    return pyrealsense2


class RealsensePipeline:
    """Started at once. Raises RuntimeError and Failed."""

    def __init__(self, where: Where, modes: Mapping[Stream, Mode]) -> None:
        self._rs = rs = library()
        kinds = {
            Stream.COLOUR: (rs.stream.color, -1, rs.format.bgr8),
            Stream.INFRARED: (rs.stream.infrared, 1, rs.format.y8),
            Stream.INFRARED_RIGHT: (rs.stream.infrared, 2, rs.format.y8),
            Stream.DEPTH: (rs.stream.depth, -1, rs.format.z16),
        }
        config = rs.config()
        if where.recording:
            if not Path(where.recording).is_file():
                raise Failed(f"there is no file {where.recording}")
            config.enable_device_from_file(where.recording, True)
        elif where.serial:
            config.enable_device(where.serial)
        for stream, mode in modes.items():
            kind, index, pixels = kinds[stream]
            # A recording has the size, rate and pixels that it has.
            wanted = mode if where.recording else _or_usual(mode)
            pixels = rs.format.any if where.recording else pixels
            config.enable_stream(kind, index, wanted.width, wanted.height, pixels, wanted.rate_hz)
        self._kinds = {stream: kinds[stream][:2] for stream in modes}
        self._align = rs.align(rs.stream.color)
        self._pipeline = rs.pipeline()
        self._pipeline.start(config)

    def frames(self, timeout_ms: int, *, is_aligned: bool) -> Mapping[Stream, Any] | None:
        """See Pipeline. The library keeps one set of frames at most until it is fetched."""
        came, together = self._pipeline.try_wait_for_frames(timeout_ms)
        if not came:
            return None
        found: dict[Stream, Any] = {}
        for stream, (kind, index) in self._kinds.items():
            for frame in together:
                profile = frame.get_profile()
                if profile.stream_type() == kind and index in (-1, profile.stream_index()):
                    found[stream] = frame
        if is_aligned and Stream.DEPTH in found and Stream.COLOUR in found:
            found[Stream.ALIGNED] = self._align.process(together).get_depth_frame()
        return found

    def stop(self) -> None:
        """See Pipeline."""
        self._pipeline.stop()


def _or_usual(mode: Mode) -> Mode:
    return Mode(mode.width or _USUAL.width, mode.height or _USUAL.height, mode.rate_hz or _USUAL.rate_hz)
