"""What the recorder has of one drone: the newest frames, and the seconds before a flight that may begin now.

The frame path calls `add`, which appends to a list. Everything else happens once for many frames:

- Frames become a chunk, as they stand in the file, `FLYING_CHUNK_S` after the first of them while a flight is recorded,
  else after `IDLE_CHUNK_S`.
- A chunk goes to the flight; without a flight it goes into a ring, bounded in seconds and bytes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Final

from server.flights.core.tlog import STAMP
from server.link.core.token_bucket import TokenBucket

FLYING_CHUNK_S: Final = 0.3
"""Together with the writer's pause this stays below the second that a crash may cost."""
IDLE_CHUNK_S: Final = 5.0
MAX_CHUNK_FRAMES: Final = 1000
"""Frames of a drone that floods the tower do not wait longer."""
_MAX_PARTS: Final = 2 * MAX_CHUNK_FRAMES
MAX_EVENTS_BEFORE: Final = 64

_stamp: Final = STAMP.pack

TakeChunk = Callable[[bytes, int], None]
"""Takes a chunk and the number of its frames. Returns at once."""


class Tape:
    """`now`: monotonic seconds. `offset_us`: what added to them gives microseconds since 1970. `ring_bytes`: at most,
    changed by the recorder as drones come and go. `hand`: whose sticks passed last, and `hand_at` when."""

    __slots__ = (
        "_before_s",
        "_chunk_at",
        "_parts",
        "_ring",
        "_ring_size",
        "events_before",
        "hand",
        "hand_at",
        "last_at",
        "offset_us",
        "refused",
        "ring_bytes",
        "starts",
        "take",
        "team",
    )

    def __init__(self, *, offset_us: int, before_s: float, ring_bytes: int) -> None:
        self.offset_us = offset_us
        self.ring_bytes = ring_bytes
        self.take: TakeChunk | None = None
        """Of the flight that is being recorded."""
        self.hand: tuple[int, str] | None = None
        self.hand_at = float("-inf")
        self.last_at = float("-inf")
        """When the newest chunk ended."""
        self.starts: TokenBucket | None = None
        """How many flights may begin now; None: none has begun yet."""
        self.refused = False
        """The flight that goes on is not recorded, and that was counted."""
        self.team: object = None
        """Whose drone it was when the recorder last looked."""
        self.events_before: deque[tuple[float, bytes]] = deque(maxlen=MAX_EVENTS_BEFORE)
        self._before_s = before_s
        self._parts: list[bytes] = []
        self._chunk_at = float("-inf")
        """When the first of these frames came."""
        self._ring: deque[tuple[float, bytes, int]] = deque()
        self._ring_size = 0

    def add(self, frames: Sequence[bytes], now: float) -> None:
        """Frames that passed now, in either direction."""
        parts = self._parts
        if not parts:
            self._chunk_at = now
        stamp = _stamp(int(now * 1e6) + self.offset_us)
        for frame in frames:
            parts += (stamp, frame)
        age = now - self._chunk_at
        if (age >= FLYING_CHUNK_S and (self.take is not None or age >= IDLE_CHUNK_S)) or len(parts) > _MAX_PARTS:
            self.roll(now)

    def check(self, now: float) -> None:
        """Several times a second while a flight is recorded: frames may have stopped coming."""
        if self._parts and now - self._chunk_at >= FLYING_CHUNK_S:
            self.roll(now)

    def roll(self, now: float) -> None:
        """Ends the chunk."""
        if not self._parts:
            return
        chunk, count = b"".join(self._parts), len(self._parts) // 2
        self._parts = []
        self.last_at = now
        if self.take is not None:
            self.take(chunk, count)
            return
        self._ring.append((now, chunk, count))
        self._ring_size += len(chunk)
        while self._ring and (self._ring_size > self.ring_bytes or now - self._ring[0][0] > self._before_s):
            self._ring_size -= len(self._ring.popleft()[1])

    def begin(self, take: TakeChunk, now: float) -> None:
        """A flight begins: it gets the seconds before, and every chunk from now on."""
        self.roll(now)
        for ended_at, chunk, count in self._ring:
            if now - ended_at <= self._before_s:
                take(chunk, count)
        self._forget_ring()
        self.take = take

    def end(self, now: float) -> None:
        """The flight is over."""
        self.roll(now)
        self.take = None

    def clear(self) -> None:
        """Forgets everything that belongs to no flight."""
        self._forget_ring()
        self.events_before.clear()
        if self.take is None:
            self._parts = []

    @property
    def kept_bytes(self) -> int:
        """Of the ring."""
        return self._ring_size

    def _forget_ring(self) -> None:
        self._ring.clear()
        self._ring_size = 0
