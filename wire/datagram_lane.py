"""Datagrams that wait for a stream (the control channel's WebSocket): few, young, the newest kept.

A stalled stream would deliver stale sticks. So little waits here and not for long, the oldest are dropped first, and
losses are like those of UDP: the protocols above repeat what they need. No I/O; takes `now`.
"""

from collections import deque
from typing import Final

LANE_BYTES: Final = 16 * 1024
"""A third of a second of full telemetry, all of a second of a thin one."""

LANE_AGE_S: Final = 0.5
"""The maximum age of sticks, unless a drone's settings change it."""

STALLED_AFTER_S: Final = 1.0
"""A stream without proof of delivery for this long gets keep-alives only. This also bounds what operating systems and
proxies on the way can hold."""


class DatagramLane:
    """First in, first out, with a bound in bytes and in time."""

    def __init__(self) -> None:
        self.lost = 0
        """Datagrams that were thrown away."""
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._bytes = 0

    def __len__(self) -> int:
        """Datagrams that wait."""
        return len(self._waiting)

    def put(self, datagram: bytes, now: float) -> None:
        """Takes it, at the cost of the oldest if there is no room."""
        self._waiting.append((now, datagram))
        self._bytes += len(datagram)
        while self._bytes > LANE_BYTES:
            self._lose_oldest()

    def pop(self, now: float) -> bytes | None:
        """The oldest that is not too old, or None."""
        while self._waiting and now - self._waiting[0][0] > LANE_AGE_S:
            self._lose_oldest()
        if not self._waiting:
            return None
        _, datagram = self._waiting.popleft()
        self._bytes -= len(datagram)
        return datagram

    def clear(self) -> None:
        """Forgets what waits: the transport has changed."""
        self._waiting.clear()
        self._bytes = 0

    def _lose_oldest(self) -> None:
        self._bytes -= len(self._waiting.popleft()[1])
        self.lost += 1
