"""A recording as the relay of video sees it: takes every unit of one stream, never waits, and knows when it is over."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from server.live.video.situation import VideoSituation
from server.live.video.streams import StreamKey
from server.store.recordings.writer import UnitWriter
from wire.video import Codec, Quality, UnitHead

TOO_LARGE: Final = "it has reached the largest size of a recording"


class RecordingSink:
    """A server.live.video.streams.StreamSink. `on_over`: called once with why nothing more is taken. `last_at`: when
    the last unit came, monotonic seconds; the beginning before the first one."""

    def __init__(
        self,
        key: StreamKey,
        writer: UnitWriter,
        *,
        largest_bytes: int,
        began: float,
        on_over: Callable[[str], None],
    ) -> None:
        self._key = key
        self._writer = writer
        self._largest_bytes = largest_bytes
        self._on_over = on_over
        self._over = False
        self.pictures = 0
        self.last_at = began

    @property
    def quality(self) -> Quality:
        return self._key.quality

    @property
    def codec(self) -> Codec:
        return self._key.codec

    def unit(self, message: bytes, head: UnitHead, now: float) -> None:
        """One unit for the file."""
        if self._over:
            return
        if not self._writer.put(message, round(now * 1_000_000)):
            self._end(self._writer.problem)
            return
        self.pictures += 1
        self.last_at = now
        if self._writer.taken_bytes >= self._largest_bytes:
            self._end(TOO_LARGE)

    def state(self, situation: VideoSituation) -> None:
        """A recording waits for a camera that comes back: its pause is a pause in the file."""

    def ended(self, why: str) -> None:
        """Nothing comes any more."""
        self._end(why)

    def _end(self, why: str) -> None:
        if not self._over:
            self._over = True
            self._on_over(why)
