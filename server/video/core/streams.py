"""One stream of a drone's video: its newest group of pictures, for present and new viewers. Pure.

A group begins with a key picture and needs nothing before it. The tower keeps only the newest group of each stream.
Viewers have a position in it (server.video.core.pacing), so a slow one has no queue of its own.
"""

from typing import Final, NamedTuple, Protocol

from server.video.core.situation import VideoSituation
from wire.video import Codec, Quality, UnitHead

MAX_UNITS: Final = 150
MAX_BYTES: Final = 4 * 1024 * 1024
"""Maximum size of a group: several seconds of the highest quality. An agent without key pictures is asked for one."""
_SEQUENCES: Final = 1 << 32


class StreamKey(NamedTuple):
    """Which of a drone's streams."""

    quality: Quality
    codec: Codec


class StreamSink(Protocol):
    """Whoever takes every unit of one stream, such as a recording. Never waits: what takes long is done elsewhere."""

    @property
    def quality(self) -> Quality:
        """The viewer's stream; does not change while it is attached."""

    @property
    def codec(self) -> Codec:
        """As `quality`."""

    def unit(self, message: bytes, head: UnitHead, now: float) -> None:
        """One unit, as in wire.video, its `capture_us` by the tower's clock. The first one is a key, and so is the
        first one after a gap or a break: what lies between is never given. `now`: monotonic seconds."""

    def state(self, situation: VideoSituation) -> None:
        """How it is with the drone's video: at the beginning, and on each change."""

    def ended(self, why: str) -> None:
        """It was detached by the tower, not by its owner: nothing comes any more. `why` is for people."""


class Relayed(NamedTuple):
    """A unit on its way. `message`: as in wire.video; `framed`: the same as one WebSocket message, built once and
    written to all viewers. `at`: when it came, monotonic seconds."""

    message: bytes
    framed: bytes
    head: UnitHead
    at: float


class Stream:
    """The newest group of pictures. `number` grows with each group, so that places in older ones are known as such."""

    def __init__(self) -> None:
        self.group: list[Relayed] = []
        self.previous: list[Relayed] = []
        """The group before, for those who are about to be sent the end of it."""
        self.number = 0
        self.began = 0
        """How many units were passed on before this group."""
        self.lacks_key = True
        """Nothing can be passed on before the next key picture."""
        self._bytes = 0
        self._passed_on = 0
        self._sequence = -1

    def follows(self, head: UnitHead) -> bool:
        """Whether a unit can be decoded with what came before it. If not, it is not to be passed on."""
        expected = (self._sequence + 1) % _SEQUENCES
        self._sequence = head.sequence
        if head.key:
            return True
        if head.is_break or head.sequence != expected or self.is_too_long():
            self.broken()
        return not self.lacks_key

    def is_too_long(self) -> bool:
        """Whether no further unit fits into this group."""
        return len(self.group) >= MAX_UNITS or self._bytes >= MAX_BYTES

    def put(self, unit: Relayed) -> None:
        """A unit came that `follows`."""
        if unit.head.key:
            self._begin_group(self.group if not unit.head.is_break else [])
            self.lacks_key = False
        self.group.append(unit)
        self._passed_on += 1
        self._bytes += len(unit.message)

    def broken(self) -> None:
        """What comes next does not follow: the camera was away, the channel another one, or something was lost."""
        self._begin_group([])
        self.lacks_key = True

    def _begin_group(self, previous: list[Relayed]) -> None:
        self.previous, self.group = previous, []
        self.number += 1
        self.began = self._passed_on
        self._bytes = 0
