"""A camera in the network through FFmpeg (RTSP, and whatever else it opens), with all its waiting switched off."""

import ssl
from collections.abc import Iterator
from typing import Final
from urllib.parse import urlsplit

import av
from av.container import InputContainer

from onboard_agent.video.sources.arrival_clock import ArrivalClock
from onboard_agent.video.sources.decoding import SIZE_BOUND, check_stream, hold_nothing, lost, lost_while_decoding
from onboard_agent.video.sources.source import (
    NETWORK_LETS_GO_WITHIN_S,
    OPEN_PATIENCE_S,
    READ_PATIENCE_S,
    CameraLost,
    PictureRequest,
    Source,
    Taken,
    now_us,
)

# Not `nobuffer`: it drops the pictures by which FFmpeg detected the format, the first key picture among them.
_NO_WAITING: Final = {
    "flags": "low_delay",
    "probesize": "32768",
    "analyzeduration": "500000",
    "fpsprobesize": "0",
    "max_delay": "0",
}
_BY_SCHEME: Final = {
    "rtsp": {"rtsp_transport": "tcp", "reorder_queue_size": "0"},
    "https": {"tls_verify": "1", "ca_file": ssl.get_default_verify_paths().cafile or ""},
}


_ENDS_WHERE_NEXT_BEGINS: Final = ("h264", "hevc")
"""FFmpeg ignores RTP's mark of the last packet and returns a picture when the next one begins. We cannot get it sooner,
but we know how long that took, and count it as age."""

_MAX_HOLD_US: Final = 500_000


class NetworkSource(Source):
    """Reads as long as pictures are wanted. Decodes all of them, because none in a chain can be left out."""

    lets_go_within_s = NETWORK_LETS_GO_WITHIN_S

    def __init__(self, name: str, address: str) -> None:
        super().__init__(name)
        self._address = address
        self._container: InputContainer | None = None
        self._taken: Iterator[Taken] = iter(())

    def open(self, request: PictureRequest) -> None:
        options = {**_NO_WAITING, **SIZE_BOUND, **_BY_SCHEME.get(urlsplit(self._address).scheme, {})}
        try:
            self._container = av.open(self._address, options=options, timeout=(OPEN_PATIENCE_S, READ_PATIENCE_S))
        except (av.FFmpegError, OSError, ValueError) as error:
            raise lost(self.name, error) from error
        check_stream(self.name, self._container)
        self._taken = self._pictures(self._container, ArrivalClock() if self._has_stamps else None)

    def read(self) -> Taken | None:
        try:
            taken = next(self._taken, None)
        except (av.FFmpegError, OSError) as error:
            raise lost_while_decoding(self.name, error) from error
        if taken is None:
            raise CameraLost(f"{self.name}: has ended")
        return taken

    def close(self) -> None:
        self._taken = iter(())
        if self._container is not None:
            self._container.close()
            self._container = None

    @property
    def _has_stamps(self) -> bool:
        """RTP's are the camera's. Others are often made up by FFmpeg, from a rate that it guesses."""
        return urlsplit(self._address).scheme == "rtsp"

    @staticmethod
    def _pictures(container: InputContainer, clock: ArrivalClock | None) -> Iterator[Taken]:
        stream = container.streams.video[0]
        hold_nothing(stream.codec_context)
        held = stream.codec_context.name in _ENDS_WHERE_NEXT_BEGINS
        before_us: int | None = None
        for packet in container.demux(stream):
            arrived_us = now_us()
            try:
                frames = packet.decode()
            except av.InvalidDataError:  # begun in the middle, or damaged on the way: the next key picture mends it
                continue
            for frame in frames:
                assert isinstance(frame, av.VideoFrame)
                if clock is None or frame.pts is None or frame.time_base is None:
                    yield Taken(frame, arrived_us)
                    continue
                stamp_us = int(frame.pts * frame.time_base * 1_000_000)
                apart_us = stamp_us - before_us if held and before_us is not None else 0
                before_us = stamp_us
                waited_us = apart_us if 0 < apart_us <= _MAX_HOLD_US else 0
                yield Taken(frame, clock.taken_us(stamp_us, arrived_us) - waited_us)
