"""Where the scope of an ASGI connection carries its anonymous visit, and how a sign-in ends that visit."""

from __future__ import annotations

from typing import Final

from starlette.requests import HTTPConnection

from server.live.anonymous.budget import AnonymousVisit

VISIT: Final = "tower.visit"
"""Scope key: the AnonymousVisit of this request."""
GUEST: Final = "tower.guest"
"""Scope key: the AnonymousConnection that carried the request."""


def admitted(connection: HTTPConnection) -> None:
    """Marks the client as signed in: call it right after the sign-in was checked."""
    visit = connection.scope.get(VISIT)
    if isinstance(visit, AnonymousVisit):
        visit.admit()
