"""Tracks whether the holder is present, and for how long they have been missing. No I/O; takes `now`.

Missing means: no live browser, and no program that keeps the controls by REST. Two seconds of it while flying by hand
cause a hold; the grace time ends the lease.
"""

from dataclasses import dataclass
from typing import Final

from wire.ids import UserId

GONE_AFTER_S: Final = 2.0
GRACE_S: Final = 30.0

KEPT_FOR_S: Final = 5.0
"""How long one keep-alive of a program counts: as long as a browser may leave a ping unanswered."""


@dataclass
class HolderWatch:
    """One for each drone. `missing_since`: None while the holder is present, or there is no holder."""

    missing_since: float | None = None
    by_hand: bool = False
    """Whether the drone was flown by hand when the holder went."""
    kept_until: float = float("-inf")
    """The holder's program keeps the controls until then."""
    kept_by: UserId | None = None
    _loss_reported: bool = False
    _expiry_reported: bool = False

    def present(self) -> None:
        """The holder is present, or there is none."""
        self.missing_since = None
        self._loss_reported = self._expiry_reported = False

    def keep(self, user_id: UserId, now: float) -> None:
        """A program of the holder sends a keep-alive."""
        self.kept_by, self.kept_until = user_id, now + KEPT_FOR_S

    def kept(self, user_id: UserId | None, now: float) -> bool:
        """Whether a program of this user sent a keep-alive recently."""
        return user_id is not None and user_id == self.kept_by and now < self.kept_until

    def missing(self, *, by_hand: bool, now: float) -> None:
        """The holder has no live browser. Only the first call counts until they are back."""
        if self.missing_since is None:
            self.missing_since = now
            self.by_hand = by_hand

    def gone(self, now: float) -> bool:
        """True once, when a holder who flew by hand has been missing for too long."""
        if self._loss_reported or not self.by_hand or not self._missing_for(GONE_AFTER_S, now):
            return False
        self._loss_reported = True
        return True

    def expired(self, now: float) -> bool:
        """True once, when the grace time is over."""
        if self._expiry_reported or not self._missing_for(GRACE_S, now):
            return False
        self._expiry_reported = True
        return True

    @property
    def has_expired(self) -> bool:
        """Whether the end of the grace time was reported and the holder is still missing."""
        return self._expiry_reported

    def _missing_for(self, seconds: float, now: float) -> bool:
        return self.missing_since is not None and now - self.missing_since >= seconds
