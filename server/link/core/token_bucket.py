"""A token bucket: a rate and a burst. Takes `now`; no I/O."""


class TokenBucket:
    """Full at the beginning. `rate_per_s` above 0, `burst` at least 1."""

    __slots__ = ("_at", "_burst", "_level", "_rate_per_s")

    def __init__(self, rate_per_s: float, burst: float, now: float) -> None:
        self._rate_per_s = rate_per_s
        self._burst = burst
        self._level = burst
        self._at = now

    def take(self, count: float, now: float, *, leave: float = 0.0) -> bool:
        """Takes `count` tokens if that leaves at least `leave`. All or none."""
        level = self._level + (now - self._at) * self._rate_per_s
        if level > self._burst:
            level = self._burst
        self._at = now
        if level < count + leave:
            self._level = level
            return False
        self._level = level - count
        return True

    def owe(self, count: float, now: float) -> None:
        """Takes what is known only after it was used. The debt is one burst at most."""
        self._level = max(self.level(now) - count, -self._burst)
        self._at = now

    def give_back(self, count: float) -> None:
        """What was taken and not used."""
        self._level = min(self._level + count, self._burst)

    def wait_s(self, count: float) -> float:
        """After a failed `take`: seconds until `count` tokens are available; `count` at most the burst."""
        return max(0.0, count - self._level) / self._rate_per_s

    def level(self, now: float) -> float:
        """The tokens that are available."""
        return min(self._level + (now - self._at) * self._rate_per_s, self._burst)

    def is_full(self, now: float) -> bool:
        """Whether it is as good as a new one, and need not be remembered."""
        return self._level + (now - self._at) * self._rate_per_s >= self._burst
