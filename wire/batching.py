"""Packs frames to one peer into as few datagrams as the deadline allows. No I/O; takes `now`.

A datagram costs the same with one frame or twenty: a system call and a seal here, an opening there, and 28 bytes of
headers on the air. So a frame that is not urgent (`wire.urgency`) waits for at most `wait_s` and shares a datagram with
later ones. An urgent frame leaves at once and takes waiting ones along: the order never changes. A batch has one epoch;
a frame of another epoch sends the batch off.
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
    """Holds at most one datagram's worth of frames. `room_bytes` is what a datagram has for frames; it may change."""

    __slots__ = ("_bytes", "_epoch", "_frames", "due_at", "room_bytes", "wait_s")

    def __init__(self, room_bytes: int) -> None:
        self.room_bytes = room_bytes
        self.wait_s = MAX_WAIT_S
        """For the batches that begin from here on."""
        self.due_at: float | None = None
        """When `due` has something; None while nothing waits."""
        self._frames: list[bytes] = []
        self._bytes = 0
        self._epoch = Epoch(0)

    def add(self, epoch: Epoch, frames: Iterable[bytes], now: float) -> list[Batch]:
        """Takes frames in order. Returns what has to leave now: what is full, and all of it if one is urgent.

        A frame that is larger than the room (never one of MAVLink's) leaves alone.
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
        # After an urgent frame, later ones of the same call may as well leave with it.
        if self._frames and (urgent or self.room_bytes - self._bytes <= 0):
            leaving.append(self._take())
        return leaving

    def due(self, now: float) -> list[Batch]:
        """What has waited long enough."""
        return [self._take()] if self.due_at is not None and now >= self.due_at else []

    def _take(self) -> Batch:
        batch = Batch(self._epoch, self._frames)
        self._frames = []
        self._bytes = 0
        self.due_at = None
        return batch
