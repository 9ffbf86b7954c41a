"""Where the scope of an ASGI connection carries its anonymous visit, and how a sign-in ends that visit."""

from __future__ import annotations

from typing import Final

from starlette.requests import HTTPConnection

from server.live.anonymous.budget import AnonymousVisit

VISIT: Final = "tower.visit"
"""Key of the scope: the AnonymousVisit of this request."""
GUEST: Final = "tower.guest"
"""Key of the scope: the AnonymousConnection that the request came by."""


def admitted(connection: HTTPConnection) -> None:
    """Whoever sent this has signed in: call it where that has just been checked."""
    visit = connection.scope.get(VISIT)
    if isinstance(visit, AnonymousVisit):
        visit.admit()
