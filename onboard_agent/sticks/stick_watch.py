"""Whether the holder's sticks have stopped during flight by hand: then the agent holds. No I/O.

The first to notice, whatever the reason: a stalled browser, a full network, a lost tower. A radio pilot never sent
sticks through the tower, so nothing can go stale.
"""


class StickWatch:
    """Tell it of every stick frame that passes to the autopilot; ask `stale` at each tick."""

    def __init__(self) -> None:
        self._fresh_at: float | None = None

    def passed(self, now: float) -> None:
        """Fresh sticks of the holder went to the autopilot."""
        self._fresh_at = now

    @property
    def hand_on(self) -> bool:
        """Whether somebody flies by hand, by the sticks received."""
        return self._fresh_at is not None

    def over(self) -> None:
        """Flying by hand has ended in good order: by a command that needs no sticks, or by a hold."""
        self._fresh_at = None

    def stale(self, now: float, *, stale_s: float, flown_by_hand: bool) -> bool:
        """True once, when no fresh sticks have come for `stale_s` while the drone needs them."""
        if self._fresh_at is None or now - self._fresh_at < stale_s:
            return False
        self._fresh_at = None
        return flown_by_hand
