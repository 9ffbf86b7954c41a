"""Packs frames to one peer into as few datagrams as the deadline allows. No I/O; takes `now`.

A datagram costs the same whether it carries one frame or twenty: a system call and a seal here, an opening there, and
28 bytes of headers on the air. So a frame that is not urgent (`wire.urgency`) waits for at most `wait_s` and shares a
datagram with those that arrive meanwhile. An urgent frame leaves at once and takes the waiting frames along, so the
order never changes. A batch has one epoch; a frame of another epoch sends the batch off.
"""

from collections.abc import Iterable
from typing import Final, NamedTuple

from wire.ids import Epoch
from wire.urgency import is_urgent

MAX_WAIT_S: Final = 0.010
"""Half the interval of sticks at 50 Hz; not visible on a map."""

CLOSE_WAIT_S: Final = 0.002
"""While the drone has a holder: long enough for the frames that an autopilot sends together."""


class Batch(NamedTuple):
    """Frames that leave in one datagram."""

    epoch: Epoch
    frames: list[bytes]


class Batcher:
    """Holds at most one datagram of frames. `room_bytes`: room for frames in a datagram; it may change."""

    __slots__ = ("_bytes", "_epoch", "_frames", "due_at", "room_bytes", "wait_s")

    def __init__(self, room_bytes: int) -> None:
        self.room_bytes = room_bytes
        self.wait_s = MAX_WAIT_S
        """Applies to batches that begin after a change."""
        self.due_at: float | None = None
        """When `due` has something; None while nothing waits."""
        self._frames: list[bytes] = []
        self._bytes = 0
        self._epoch = Epoch(0)

    def add(self, epoch: Epoch, frames: Iterable[bytes], now: float) -> list[Batch]:
        """Takes frames in order. Returns what must leave now: full batches, and everything if a frame is urgent.

        A frame larger than the room (never a MAVLink frame) leaves alone.
        """
        leaving: list[Batch] = []
        urgent = False
        for frame in frames:
            size = len(frame)
            if self._frames and (epoch != self._epoch or self._bytes + size > self.room_bytes):
                leaving.append(self._take())
            if not self._frames:
                self._epoch = epoch
                self.due_at = now + self.wait_s
            self._frames.append(frame)
            self._bytes += size
            urgent = urgent or is_urgent(frame)
        # Frames behind an urgent one in the same call leave with it.
        if self._frames and (urgent or self.room_bytes - self._bytes <= 0):
            leaving.append(self._take())
        return leaving

    def due(self, now: float) -> list[Batch]:
        """Returns the frames that have waited long enough."""
        return [self._take()] if self.due_at is not None and now >= self.due_at else []

    def _take(self) -> Batch:
        batch = Batch(self._epoch, self._frames)
        self._frames = []
        self._bytes = 0
        self.due_at = None
        return batch
