"""Whether the pilot was lost while flying by hand, so that the agent must hold. Also how long the tower has been gone.
No I/O.

A link that breaks and returns within the timeout is not yet safe: the pilot's sticks must return too. Once the link has
broken, only sticks, or a command to fly without them, call off the alarm.
"""

from typing import Final

BY_HAND_WITHIN_S: Final = 1.0
"""Sticks that came this shortly before the loss mean that a hand was on them."""

HALF_OPEN_S: Final = 8.0
"""A control channel whose other end vanished is noticed within this time: the tower was gone when its datagrams
were."""


class LinkLoss:
    """Tell it of everything that comes from the tower; ask `lost_by_hand` at each tick."""

    def __init__(self, now: float) -> None:
        self._heard_at = now
        self._sticks_at: float | None = None
        self._broken_at: float | None = None
        self._gone_at: float | None = None

    def tower_heard(self, now: float) -> None:
        """An authentic datagram came."""
        self._heard_at = now

    def link_up(self, now: float) -> None:
        """The tower has welcomed us."""
        self._gone_at = None
        self.tower_heard(now)

    def link_down(self, now: float) -> None:
        """The link ended, by either side."""
        if self._gone_at is None:
            self._gone_at = self._heard_at if now - self._heard_at < HALF_OPEN_S else now
        self.pilot_cut_off(now)

    def sticks_passed(self, now: float) -> None:
        """Sticks of the holder went to the autopilot."""
        self._sticks_at = now
        self._broken_at = None

    def flies_without_sticks(self) -> None:
        """The holder has commanded something that needs no hands, or a hold has taken over."""
        self._sticks_at = None
        self._broken_at = None

    def pilot_cut_off(self, now: float) -> None:
        """The link ended, or the tower reports that the holder's own connection did."""
        if self._broken_at is None and self._sticks_at is not None:
            self._broken_at = min(now, self._heard_at)

    def silent_s(self, now: float) -> float:
        """Seconds since the last datagram of the tower."""
        return now - self._heard_at

    def tower_gone_s(self, now: float) -> float:
        """Seconds since there was last either a datagram of the tower or a control channel; 0 while there is.

        A tower that has not been there since the agent started cannot be lost: 0 as well.
        """
        return 0.0 if self._gone_at is None else now - self._gone_at

    def lost_by_hand(self, now: float, *, lost_hold_s: float) -> bool:
        """True once, when the time-out has passed after a loss that took the sticks out of a hand."""
        if self.silent_s(now) >= lost_hold_s:
            self.pilot_cut_off(now)
        if self._broken_at is None or self._sticks_at is None or now - self._broken_at < lost_hold_s:
            return False
        by_hand = self._sticks_at >= self._broken_at - BY_HAND_WITHIN_S
        self._sticks_at = self._broken_at = None
        return by_hand
