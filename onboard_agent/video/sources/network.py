"""A network camera through FFmpeg (RTSP and other protocols), with all of FFmpeg's buffering switched off."""

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

# Not `nobuffer`: it discards the pictures that FFmpeg used to detect the format, including the first key picture.
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
"""FFmpeg ignores RTP's marker for the last packet of a picture, and returns the picture when the next one begins. That
wait cannot be avoided, but its length is known and counts as age."""

_MAX_HOLD_US: Final = 500_000


class NetworkSource(Source):
    """Reads while the camera is in use. Decodes every picture, because later ones depend on it."""

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
        """RTP timestamps come from the camera. For other protocols FFmpeg often makes them up from a guessed rate."""
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
            except av.InvalidDataError:  # joined in the middle, or damaged in transit: the next key picture repairs it
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
