"""Sign-ins that the database confirmed, for the time in which it does not answer.

They let pilots fly on, and let a drone be made to hold. A remembered sign-in counts only while the live state knows it
too, which learns within a second of ended accounts and sessions. It cannot change anything stored, because that takes
the database.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Callable
from datetime import datetime
from typing import Final

from server.domain.people import Principal

MAX_REMEMBERED: Final = 4096
"""The sign-in that was used longest ago is forgotten first."""


class RememberedSignIns:
    """By a hash of the cookie or token. `is_current`: the live state's answer."""

    def __init__(self, is_current: Callable[[Principal, int], bool]) -> None:
        self._is_current = is_current
        self._known: OrderedDict[bytes, tuple[Principal, int]] = OrderedDict()

    def note(self, secret: str, found: Principal | None, revision: int) -> None:
        """The database's answer; `revision`: of the fleet, before the query."""
        key = _key(secret)
        self._known.pop(key, None)
        if found is not None:
            self._known[key] = found, revision
            if len(self._known) > MAX_REMEMBERED:
                self._known.popitem(last=False)

    def find(self, secret: str, now: datetime) -> Principal | None:
        """Who that was, if it still counts."""
        found, revision = self._known.get(_key(secret), (None, 0))
        return found if found is not None and now < found.expires_at and self._is_current(found, revision) else None


def _key(secret: str) -> bytes:
    return hashlib.sha256(secret.encode(errors="surrogatepass")).digest()
