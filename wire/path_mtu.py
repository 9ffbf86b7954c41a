"""Finds the largest datagram that passes unfragmented, by padded probes (after RFC 8899). No I/O; takes `now`.

The search begins at a size that every path must carry, tries the largest useful size, and then halves the gap. A probe
sets "do not fragment"; all other datagrams may be fragmented, so a path that shrinks costs speed, not the link. The
size found is tested again from time to time; if it no longer passes, the search begins again.

The agent probes. The tower adopts the sizes it has seen arrive: on nearly every path both directions have the same
limit. With several uplinks in use, each datagram travels on all of them, so the smallest limit applies.
"""

from collections.abc import Collection
from typing import Final

from wire.sealing import MAX_DATAGRAM_BYTES

SAFE_DATAGRAM_BYTES: Final = 1200
"""Passes on every path that IPv6 allows, tunnels included: the size before anything is known of the path."""

CLOSE_ENOUGH_BYTES: Final = 16
PROBE_AGAIN_S: Final = 1.0
"""The deadline for a probe's answer."""
TRIES: Final = 3
"""At one loss in ten, three probes in a row are lost once in a thousand; then the size counts as too large."""
VERIFY_S: Final = 30.0
SEARCH_AGAIN_S: Final = 600.0
BELIEVED_FOR_S: Final = 100.0
"""On the side that does not probe: three probes of the other side have not arrived."""

SILENT_UPLINK_S: Final = 2.0
"""On the side that does not probe: an uplink silent for this long, while another is not, is not sent to."""


class PathMtu:
    """The side that probes."""

    def __init__(self, now: float) -> None:
        self.datagram_bytes = SAFE_DATAGRAM_BYTES
        """The largest size known to pass."""
        self._trying = MAX_DATAGRAM_BYTES
        self._too_large = MAX_DATAGRAM_BYTES + 1
        self._tries = 0
        self._next = now
        self._searching = True
        self._searched_at = now

    def probe_due(self, now: float) -> int | None:
        """Returns the size of a probe to send now, or None."""
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
        """Notes that a probe of this size was answered."""
        if datagram_bytes < self._trying:
            return
        self.datagram_bytes = max(self.datagram_bytes, datagram_bytes)
        self._aim(now)

    def _failed(self, now: float) -> None:
        if not self._searching:
            # A size that used to pass no longer does: the path has changed.
            self.datagram_bytes = SAFE_DATAGRAM_BYTES
            self._search_again()
        else:
            self._too_large = self._trying
            self._aim(now)

    def _search_again(self) -> None:
        self._too_large = MAX_DATAGRAM_BYTES + 1
        self._searching = True
        self._trying = MAX_DATAGRAM_BYTES
        self._tries = 0

    def _aim(self, now: float) -> None:
        """Chooses the next size to try: one in between, or after the search the same size again after a while."""
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


class PathMtus:
    """The side that probes, with its uplinks 0..`uplinks` - 1."""

    def __init__(self, uplinks: int, now: float) -> None:
        self.datagram_bytes = SAFE_DATAGRAM_BYTES
        """The largest size that passed on every uplink that worked at the last call of `probes_due`."""
        self._paths = [PathMtu(now) for _ in range(uplinks)]

    def probes_due(self, working: Collection[int], now: float) -> list[tuple[int, int]]:
        """Returns (uplink, size) of the probes to send now. `working`: the uplinks that carry datagrams at present.

        The others are not probed, because that would show nothing, and do not limit the size meanwhile.
        """
        due = [(number, self._paths[number].probe_due(now)) for number in working]
        if due:
            self.datagram_bytes = min(self._paths[number].datagram_bytes for number in working)
        return [(number, size) for number, size in due if size is not None]

    def answered(self, uplink: int, datagram_bytes: int, now: float) -> None:
        """Notes that a probe of this size was answered on this uplink."""
        self._paths[uplink].answered(datagram_bytes, now)


class _Seen:
    """The state of one uplink."""

    def __init__(self, now: float) -> None:
        self.datagram_bytes = SAFE_DATAGRAM_BYTES
        self.seen_at = self.heard_at = now


class SeenMtu:
    """The side that does not probe."""

    def __init__(self) -> None:
        self.datagram_bytes = SAFE_DATAGRAM_BYTES
        """The smallest limit of the other side's uplinks."""
        self._uplinks: dict[int, _Seen] = {}

    def probe_came(self, uplink: int, datagram_bytes: int, now: float) -> None:
        """Notes that a probe of this size arrived unfragmented on the uplink with this number (0..255)."""
        seen = self._uplinks.setdefault(uplink, _Seen(now))
        seen.heard_at = now
        if datagram_bytes >= seen.datagram_bytes:
            seen.datagram_bytes, seen.seen_at = datagram_bytes, now
        self.check(now)

    def check(self, now: float) -> None:
        """Applies the passage of time: a size without a recent probe reverts to the safe size, and an uplink that is
        silent while another is not does not count."""
        if not self._uplinks:
            return
        for seen in self._uplinks.values():
            if now - seen.seen_at > BELIEVED_FOR_S:
                seen.datagram_bytes = SAFE_DATAGRAM_BYTES
        last = max(seen.heard_at for seen in self._uplinks.values())
        limits = (one.datagram_bytes for one in self._uplinks.values() if last - one.heard_at <= SILENT_UPLINK_S)
        self.datagram_bytes = min(limits)
