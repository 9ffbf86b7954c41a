"""A short queue of datagrams for a stream (the control channel's WebSocket) that keeps the newest. No I/O; takes `now`.

A stalled stream would deliver old sticks late. So the queue is small and short-lived, and evicts the oldest first. A
datagram lost here is lost as on UDP: a receiver that needs it requests it again.
"""

from collections import deque
from typing import Final

LANE_BYTES: Final = 16 * 1024
"""A third of a second of full telemetry, a full second of thin telemetry."""

LANE_AGE_S: Final = 0.5
"""The limit for late sticks, unless a drone's settings differ."""

STALLED_AFTER_S: Final = 1.0
"""A stream without proof of arrival for this long carries only keep-alives. This also bounds what the operating systems
and proxies on the path buffer invisibly."""


class DatagramLane:
    """A FIFO queue, bounded in bytes and in time."""

    def __init__(self) -> None:
        self.lost = 0
        """Number of evicted datagrams."""
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._bytes = 0

    def __len__(self) -> int:
        """Number of queued datagrams."""
        return len(self._waiting)

    def put(self, datagram: bytes, now: float) -> None:
        """Queues a datagram; evicts the oldest if there is no room."""
        self._waiting.append((now, datagram))
        self._bytes += len(datagram)
        while self._bytes > LANE_BYTES:
            self._lose_oldest()

    def pop(self, now: float) -> bytes | None:
        """Returns the oldest that is not too old, or None."""
        while self._waiting and now - self._waiting[0][0] > LANE_AGE_S:
            self._lose_oldest()
        if not self._waiting:
            return None
        _, datagram = self._waiting.popleft()
        self._bytes -= len(datagram)
        return datagram

    def clear(self) -> None:
        """Empties the queue: the transport has changed."""
        self._waiting.clear()
        self._bytes = 0

    def _lose_oldest(self) -> None:
        self._bytes -= len(self._waiting.popleft()[1])
        self.lost += 1
