"""Counters of the video relay: plain integers, read by server.metrics on request."""

from collections import Counter

from server.link.core.traffic import Histogram


class VideoTraffic:
    """One for the service. Everything grows only."""

    __slots__ = ("age", "bytes_in", "bytes_out", "closes", "dropped", "skipped", "units_in", "units_out", "wait")

    def __init__(self) -> None:
        self.units_in = self.bytes_in = 0
        """From agents: all that are well formed."""
        self.units_out = self.bytes_out = 0
        """To viewers, each time one of them is sent one. Recordings are not in it."""
        self.skipped = 0
        """Units not sent because a viewer was too slow."""
        self.dropped: Counter[str] = Counter()
        """Agents' units without a recipient, by reason."""
        self.closes: Counter[int] = Counter()
        """Connections of viewers that the tower closed, by code."""
        self.age = Histogram()
        """From the capture of a picture to its arrival at the tower, where both clocks are known."""
        self.wait = Histogram()
        """From the arrival of a unit at the tower to being written to a viewer, each time. What a viewer gets who comes
        in the middle of a group is in it."""
