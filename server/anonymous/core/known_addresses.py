"""Addresses with an earlier sign-in. They keep access when strangers use up the other places. Pure.

Holds only digests, keyed with a key that the process creates and never writes: the tower's memory reveals no one's
addresses. After a restart the list is filled from the valid sessions.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict

from server.anonymous.core.networks import Origin


class KnownAddresses:
    """In total, and per name. The least recently seen address is dropped first."""

    def __init__(self, key: bytes, max_known: int) -> None:
        self._key = key
        self._max = max_known
        self._known: OrderedDict[bytes, None] = OrderedDict()

    def __len__(self) -> int:
        return len(self._known)

    def remember(self, origin: Origin, name: str = "") -> None:
        """A sign-in from this address. `name`: the user's name as key; empty: any user."""
        for one in {name, ""}:
            digest = self._digest(origin, one)
            self._known[digest] = None
            self._known.move_to_end(digest)
        while len(self._known) > self._max:
            self._known.popitem(last=False)

    def knows(self, origin: Origin, name: str = "") -> bool:
        """Whether this name (or, without one, any user) has signed in from there."""
        return self._digest(origin, name) in self._known

    def _digest(self, origin: Origin, name: str) -> bytes:
        return hashlib.blake2b(f"{origin.address}\n{name}".encode(), key=self._key, digest_size=16).digest()
