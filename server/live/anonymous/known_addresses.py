"""Addresses from which somebody has signed in: they keep a way in when strangers fill the others. Pure.

Only keyed digests are kept, under a key that the process makes and never writes: the memory of a tower tells nobody who
was where. After a restart the list is filled from the sessions that still stand.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict

from server.live.anonymous.networks import Origin


class KnownAddresses:
    """Of all people, and of each name by itself. The one not seen for longest goes first."""

    def __init__(self, key: bytes, max_known: int) -> None:
        self._key = key
        self._max = max_known
        self._known: OrderedDict[bytes, None] = OrderedDict()

    def __len__(self) -> int:
        return len(self._known)

    def remember(self, origin: Origin, name: str = "") -> None:
        """Somebody has signed in from there. `name`: as the key of a user's name; empty: whoever it was."""
        for one in {name, ""}:
            digest = self._digest(origin, one)
            self._known[digest] = None
            self._known.move_to_end(digest)
        while len(self._known) > self._max:
            self._known.popitem(last=False)

    def knows(self, origin: Origin, name: str = "") -> bool:
        """Whether this name, or with none anybody, has signed in from there."""
        return self._digest(origin, name) in self._known

    def _digest(self, origin: Origin, name: str) -> bytes:
        return hashlib.blake2b(f"{origin.address}\n{name}".encode(), key=self._key, digest_size=16).digest()
