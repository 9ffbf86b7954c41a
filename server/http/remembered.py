"""Sign-ins that the database has confirmed, for use while it does not respond.

Pilots keep flying, and a drone can be made to hold, without the database. A remembered sign-in counts only while the
live picture also knows it: the picture is updated within a second when accounts or sessions end. A remembered sign-in
cannot change stored data, because that needs the database.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Callable
from datetime import datetime
from typing import Final

from server.kernel.people import Principal

MAX_REMEMBERED: Final = 4096
"""The least recently used sign-in is evicted first."""


class RememberedSignIns:
    """Keyed by a hash of the cookie or token. `is_current`: asks the live picture."""

    def __init__(self, is_current: Callable[[Principal, int], bool]) -> None:
        self._is_current = is_current
        self._known: OrderedDict[bytes, tuple[Principal, int]] = OrderedDict()

    def note(self, secret: str, found: Principal | None, revision: int) -> None:
        """Stores the database's answer; `revision`: of the fleet, before the query."""
        key = _key(secret)
        self._known.pop(key, None)
        if found is not None:
            self._known[key] = found, revision
            if len(self._known) > MAX_REMEMBERED:
                self._known.popitem(last=False)

    def find(self, secret: str, now: datetime) -> Principal | None:
        """Returns the principal, if the sign-in still counts."""
        found, revision = self._known.get(_key(secret), (None, 0))
        return found if found is not None and now < found.expires_at and self._is_current(found, revision) else None

    def vouch(self, secret: str, now: datetime) -> tuple[Principal, int] | None:
        """The same with the revision of the fleet, for another tower."""
        return self._known[_key(secret)] if self.find(secret, now) is not None else None

    def vouched(self, principal: Principal, revision: int, now: datetime) -> Principal | None:
        """The same for a sign-in that another tower remembers: it must count in the live picture here."""
        return principal if now < principal.expires_at and self._is_current(principal, revision) else None


def _key(secret: str) -> bytes:
    return hashlib.sha256(secret.encode(errors="surrogatepass")).digest()
