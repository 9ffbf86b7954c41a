"""How large a datagram may be to pass in one piece, found out by padded probes (after RFC 8899). No I/O; takes `now`.

Begins at a size that every path must carry, tries the largest that makes sense, and else halves the gap. A probe says
"do not fragment"; everything else may be cut up on its way, so a path that shrinks costs speed and not the link. The
size that was found is tried again from time to time; where it does not pass any more, the search begins anew.

The agent probes. The tower takes over what it saw arrive: on nearly every path both directions carry the same.
"""

from typing import Final

from wire.sealing import LARGEST_DATAGRAM_BYTES

SAFE_DATAGRAM_BYTES: Final = 1200
"""Passes on every path that IPv6 allows, tunnels included: the size before anything is known of the path."""

CLOSE_ENOUGH_BYTES: Final = 16
PROBE_AGAIN_S: Final = 1.0
"""An answer that is not there after this is not waited for any longer."""
TRIES: Final = 3
"""Three probes in a row are lost one time in a thousand where one in ten is; then the size counts as too large."""
VERIFY_S: Final = 30.0
SEARCH_AGAIN_S: Final = 600.0
BELIEVED_FOR_S: Final = 100.0
"""By the side that does not probe: three probes of the other have not come."""


class PathMtu:
    """The side that probes."""

    def __init__(self, now: float) -> None:
        self.datagram_bytes = SAFE_DATAGRAM_BYTES
        """The largest that is known to pass."""
        self._trying = LARGEST_DATAGRAM_BYTES
        self._too_large = LARGEST_DATAGRAM_BYTES + 1
        self._tries = 0
        self._next = now
        self._searching = True
        self._searched_at = now

    def probe_due(self, now: float) -> int | None:
        """The size of a probe to send now, or None."""
        if now < self._next:
            return None
        if self._tries >= TRIES:
            self._failed(now)
            if now < self._next:
                return None
        if not self._searching and now - self._searched_at >= SEARCH_AGAIN_S:
            self._search_again()
        self._tries += 1
        self._next = now + PROBE_AGAIN_S
        return self._trying

    def answered(self, datagram_bytes: int, now: float) -> None:
        """A probe of this size was answered."""
        if datagram_bytes < self._trying:
            return
        self.datagram_bytes = max(self.datagram_bytes, datagram_bytes)
        self._aim(now)

    def _failed(self, now: float) -> None:
        if not self._searching:
            # What once passed does so no more: another path.
            self.datagram_bytes = SAFE_DATAGRAM_BYTES
            self._search_again()
        else:
            self._too_large = self._trying
            self._aim(now)

    def _search_again(self) -> None:
        self._too_large = LARGEST_DATAGRAM_BYTES + 1
        self._searching = True
        self._trying = LARGEST_DATAGRAM_BYTES
        self._tries = 0

    def _aim(self, now: float) -> None:
        """Chooses what to try next: something between, or once found, the same again after a while."""
        self._tries = 0
        if self._too_large - self.datagram_bytes > CLOSE_ENOUGH_BYTES:
            self._trying = (self.datagram_bytes + self._too_large) // 2
            self._next = now
        else:
            if self._searching:
                self._searching = False
                self._searched_at = now
            self._trying = self.datagram_bytes
            self._next = now + VERIFY_S


class SeenMtu:
    """The side that does not probe."""

    def __init__(self) -> None:
        self.datagram_bytes = SAFE_DATAGRAM_BYTES
        self._seen_at = 0.0

    def probe_came(self, datagram_bytes: int, now: float) -> None:
        """A probe of this size arrived in one piece."""
        if datagram_bytes >= self.datagram_bytes:
            self.datagram_bytes = datagram_bytes
            self._seen_at = now

    def outdated(self, now: float) -> bool:
        """Whether nothing of this size has come for long: then it is the safe one again."""
        if self.datagram_bytes == SAFE_DATAGRAM_BYTES or now - self._seen_at <= BELIEVED_FOR_S:
            return False
        self.datagram_bytes = SAFE_DATAGRAM_BYTES
        return True
