"""Detects that the holder's sticks have stopped while the drone flies by hand, so that the agent holds. No I/O.

The earliest detection for any cause: a stalled browser, a full network, a lost tower. A radio pilot never sent sticks
through the tower, so nothing can go stale.
"""


class StickWatch:
    """Call `passed` for every stick frame that passes to the autopilot; call `stale` at each tick."""

    def __init__(self) -> None:
        self._fresh_at: float | None = None

    def passed(self, now: float) -> None:
        """Fresh sticks from the holder went to the autopilot."""
        self._fresh_at = now

    @property
    def hand_on(self) -> bool:
        """Whether somebody flies by hand, judged by the sticks."""
        return self._fresh_at is not None

    def over(self) -> None:
        """Flying by hand has ended normally: by a command that needs no sticks, or by a hold."""
        self._fresh_at = None

    def stale(self, now: float, *, stale_s: float, flown_by_hand: bool) -> bool:
        """True once, when no fresh sticks have come for `stale_s` while the drone needs them."""
        if self._fresh_at is None or now - self._fresh_at < stale_s:
            return False
        self._fresh_at = None
        return flown_by_hand
