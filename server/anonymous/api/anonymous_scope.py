"""Where the scope of an ASGI connection carries its anonymous request, and how a sign-in ends that request."""

from __future__ import annotations

from typing import Final

from starlette.requests import HTTPConnection

from server.anonymous.core.budget import AnonymousRequest

ANONYMOUS_REQUEST: Final = "tower.anonymous_request"
"""Scope key: the AnonymousRequest of this request."""
ANONYMOUS_CONNECTION: Final = "tower.anonymous_connection"
"""Scope key: the AnonymousConnection that carried the request."""
ON_ADMITTED: Final = "tower.on_admitted"
"""Scope key: what to call when the client of a WebSocket has signed in."""


def admitted(connection: HTTPConnection) -> None:
    """Marks the client as signed in: call it right after the sign-in was checked."""
    request = connection.scope.get(ANONYMOUS_REQUEST)
    if isinstance(request, AnonymousRequest):
        request.admit()
