"""Decides which frames belong to a flight and hands them to the disk in chunks. No I/O.

The frame path calls `add`, which appends two objects to a list. A flight begins when the autopilot is armed, with what
came in the `BEFORE_S` before, and ends `AFTER_S` after it is disarmed. A silent autopilot ends nothing: it may be in
the air.
"""

from collections import deque
from collections.abc import Callable, Sequence
from struct import Struct
from typing import Final, Protocol

from wire.dialect import mavlink
from wire.frames import message_id

BEFORE_S: Final = 30.0
AFTER_S: Final = 10.0
MAX_SILENT_S: Final = 1800.0
"""An autopilot that has been silent for so long while armed is gone."""
CHUNK_S: Final = 0.3
"""Together with the writer's pause this stays below the second that a crash may cost."""
IDLE_CHUNK_S: Final = 5.0
MAX_CHUNK_FRAMES: Final = 2000
MAX_RING_BYTES: Final = 1024 * 1024
"""30 s of 500 frames a second."""
CLOCK_STEP_US: Final = 500_000
"""The time of day was set: what came before has times that do not fit."""

_SETUP_SIGNING: Final = mavlink.MAVLINK_MSG_ID_SETUP_SIGNING
"""It holds a key, and is never written."""
_stamp: Final = Struct(">Q").pack


class FlightSink(Protocol):
    """The disk. Every method returns at once."""

    def begin(self, at_us: int) -> None:
        """A flight begins."""

    def frames(self, chunk: bytes, last_us: int) -> None:
        """Entries of a telemetry log, up to this time."""

    def end(self, at_us: int) -> None:
        """The flight is over."""


class BlackBoxTape:
    """`wall_us`: the time of day in microseconds. Within a flight the times are those of the monotonic clock, so that
    setting the time of day moves nothing."""

    def __init__(self, sink: FlightSink, wall_us: Callable[[], int], now: float) -> None:
        self._sink = sink
        self._wall_us = wall_us
        self._offset_us = wall_us() - int(now * 1e6)
        self._parts: list[bytes] = []
        self._chunk_at = now
        self._ring: deque[tuple[float, bytes]] = deque()
        self._ring_bytes = 0
        self.recording = False
        self._over_at: float | None = None
        self._silent_since: float | None = None

    def now_us(self, now: float) -> int:
        """This moment by the clock of the flight that is recorded, or was recorded last."""
        return int(now * 1e6) + self._offset_us

    def add(self, frames: Sequence[bytes], now: float) -> None:
        """Frames that pass now, in either direction."""
        parts = self._parts
        if not parts:
            self._chunk_at = now
        stamp = _stamp(int(now * 1e6) + self._offset_us)
        for frame in frames:
            if message_id(frame) != _SETUP_SIGNING:
                parts += (stamp, frame)
        if len(parts) > 2 * MAX_CHUNK_FRAMES:
            self._roll(now)

    def tick(self, now: float, *, armed: bool, heard: bool) -> None:
        """Many times a second."""
        if self._parts and now - self._chunk_at >= (CHUNK_S if self.recording else IDLE_CHUNK_S):
            self._roll(now)
        if not self.recording:
            if armed and heard:
                self._begin(now)
            return
        if heard:
            self._silent_since = None
            if armed and self._over_at is not None:
                self._end(now)  # armed again: the next flight begins at the next tick
                return
            if not armed and self._over_at is None:
                self._over_at = now
        elif self._silent_since is None:
            self._silent_since = now
        is_over = self._over_at is not None and now - self._over_at >= AFTER_S
        if is_over or (self._silent_since is not None and now - self._silent_since >= MAX_SILENT_S):
            self._end(now)

    def stop(self, now: float) -> None:
        """The agent ends."""
        if self.recording:
            self._end(now)

    def _begin(self, now: float) -> None:
        self._roll(now)
        offset_us = self._wall_us() - int(now * 1e6)
        if abs(offset_us - self._offset_us) > CLOCK_STEP_US:
            self._offset_us = offset_us
            self._ring.clear()
        self._over_at = self._silent_since = None
        self.recording = True
        self._sink.begin(self.now_us(now))
        for at, chunk in self._ring:
            if now - at <= BEFORE_S:
                self._sink.frames(chunk, self.now_us(at))
        self._ring.clear()
        self._ring_bytes = 0

    def _end(self, now: float) -> None:
        self._roll(now)
        self.recording = False
        self._sink.end(self.now_us(now))

    def _roll(self, now: float) -> None:
        """Ends the chunk."""
        if not self._parts:
            return
        chunk = b"".join(self._parts)
        self._parts = []
        if self.recording:
            self._sink.frames(chunk, self.now_us(now))
            return
        self._ring.append((now, chunk))
        self._ring_bytes += len(chunk)
        while self._ring and (self._ring_bytes > MAX_RING_BYTES or now - self._ring[0][0] > BEFORE_S):
            self._ring_bytes -= len(self._ring.popleft()[1])
