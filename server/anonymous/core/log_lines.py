"""How many log lines strangers may cause. Pure."""

from __future__ import annotations

from server.link.core.token_bucket import TokenBucket


class LogBudget:
    """One limit for all such lines: each one says that somebody tries, and more of them say no more."""

    def __init__(self, per_s: float, burst: float, now: float) -> None:
        self._bucket = TokenBucket(per_s, burst, now)
        self.left_out = 0
        """Lines not written, since the tower began."""
        self._reported = 0

    def admits(self, now: float) -> bool:
        """Whether one more may be written."""
        if self._bucket.take(1.0, now):
            return True
        self.left_out += 1
        return False

    def take_unreported(self) -> int:
        """How many lines were left out before the one that is being written; counted from here on again."""
        take_unreported, self._reported = self.left_out - self._reported, self.left_out
        return take_unreported
