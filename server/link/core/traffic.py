"""Counters of the relay: plain integers and preallocated buckets, which cost a frame next to nothing.

Nothing here knows how the figures are published (server.metrics reads them on request).
"""

from bisect import bisect_left
from collections import Counter
from typing import Final

LATENCY_BOUNDS_S: Final = (0.00025, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5)
"""Upper ends of the buckets; what is longer goes into one more."""


class Histogram:
    """How long something took, in seconds."""

    __slots__ = ("counts", "total_s")

    def __init__(self) -> None:
        self.counts = [0] * (len(LATENCY_BOUNDS_S) + 1)
        """Counts of each bucket alone, not cumulative."""
        self.total_s = 0.0

    def observe(self, seconds: float, times: int = 1) -> None:
        self.counts[bisect_left(LATENCY_BOUNDS_S, seconds)] += times
        self.total_s += seconds * times


class Traffic:
    """One for the hub. Everything grows only."""

    __slots__ = (
        "browser_closes",
        "bytes_from_agents",
        "bytes_from_browsers",
        "bytes_to_agents",
        "bytes_to_browsers",
        "control_events",
        "datagrams_from_agents",
        "datagrams_to_agents",
        "down",
        "faults",
        "frames_from_agents",
        "frames_from_browsers",
        "frames_lost",
        "frames_to_agents",
        "frames_to_browsers",
        "hold_steps",
        "holds_ordered",
        "links_orphaned",
        "links_resumed",
        "loop_late",
        "messages_from_browsers",
        "messages_to_browsers",
        "refusals",
        "separation",
        "up",
    )

    def __init__(self) -> None:
        self.datagrams_from_agents = self.bytes_from_agents = self.frames_from_agents = 0
        """Authentic ones only; bytes as they came, sealed."""
        self.datagrams_to_agents = self.bytes_to_agents = self.frames_to_agents = 0
        self.messages_from_browsers = self.bytes_from_browsers = self.frames_from_browsers = 0
        self.messages_to_browsers = self.bytes_to_browsers = self.frames_to_browsers = 0
        """Frames, counted for each browser that gets them."""
        self.frames_lost = 0
        """Transactional frames reported to browsers as lost."""
        self.holds_ordered = 0
        self.links_orphaned = self.links_resumed = 0
        """Control channels that were lost while the data channel went on; and that had a successor."""
        self.hold_steps: Counter[str] = Counter()
        self.control_events: Counter[str] = Counter()
        self.refusals: Counter[str] = Counter()
        self.browser_closes: Counter[int] = Counter()
        self.faults: Counter[str] = Counter()
        """Errors of ours that cost one drone one look, by part."""
        self.separation: Counter[str] = Counter()
        """Separation alerts by level, counted each time that people are notified of another one."""
        self.up = Histogram()
        """From the socket that agents write to, to the socket of a browser: the frame that waited longest in a message
        that was due at once. State that waits for its beat is not in it."""
        self.down = Histogram()
        """From the socket of a browser to the socket that agents read from, of messages that were passed on."""
        self.loop_late = Histogram()
        """How late the hub's clock beats: what everything else waits when the tower is busy."""
