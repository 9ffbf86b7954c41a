"""Detects a pilot lost while flying by hand, so that the agent holds, and measures how long the tower is gone.

No I/O. A link that breaks and returns within the timeout is not safe until the pilot's sticks are back as well. So once
the link has broken, only sticks or a command to fly without them cancel the alarm.
"""

from typing import Final

BY_HAND_WITHIN_S: Final = 1.0
"""Sticks that came this shortly before the loss mean that a hand was on them."""

HALF_OPEN_S: Final = 8.0
"""A vanished peer of the control channel is detected within this time. The tower then counts as gone since its last
datagram."""


class LinkLoss:
    """Report all input from the tower to it; call `lost_by_hand` at each tick."""

    def __init__(self, now: float) -> None:
        self._heard_at = now
        self._sticks_at: float | None = None
        self._broken_at: float | None = None
        self._gone_at: float | None = None

    def tower_heard(self, now: float) -> None:
        """An authentic datagram arrived."""
        self._heard_at = now

    def link_up(self, now: float) -> None:
        """The tower has sent its welcome."""
        self._gone_at = None
        self.tower_heard(now)

    def link_down(self, now: float) -> None:
        """The link ended, no matter which side ended it."""
        if self._gone_at is None:
            self._gone_at = self._heard_at if now - self._heard_at < HALF_OPEN_S else now
        self.pilot_cut_off(now)

    def sticks_passed(self, now: float) -> None:
        """The holder's sticks went to the autopilot."""
        self._sticks_at = now
        self._broken_at = None

    def flies_without_sticks(self) -> None:
        """The holder has commanded something that needs no hands, or a hold has taken over."""
        self._sticks_at = None
        self._broken_at = None

    def pilot_cut_off(self, now: float) -> None:
        """The link ended, or the tower reports that the holder's connection to it ended."""
        if self._broken_at is None and self._sticks_at is not None:
            self._broken_at = min(now, self._heard_at)

    def silent_s(self, now: float) -> float:
        """Seconds since the tower's last datagram."""
        return now - self._heard_at

    def tower_gone_s(self, now: float) -> float:
        """Seconds since the tower's last datagram or the end of the link; 0 while there is a link.

        Also 0 if the agent has had no link since it started: such a tower cannot be lost.
        """
        return 0.0 if self._gone_at is None else now - self._gone_at

    def lost_by_hand(self, now: float, *, lost_hold_s: float) -> bool:
        """True once, when the timeout has passed after a loss while a hand was on the sticks."""
        if self.silent_s(now) >= lost_hold_s:
            self.pilot_cut_off(now)
        if self._broken_at is None or self._sticks_at is None or now - self._broken_at < lost_hold_s:
            return False
        by_hand = self._sticks_at >= self._broken_at - BY_HAND_WITHIN_S
        self._sticks_at = self._broken_at = None
        return by_hand
