"""Refuses requests that another web site made a browser send: the Origin must be the tower's own.

The session cookie is already SameSite=Strict; this is the second barrier, and for WebSockets the first.
"""

from __future__ import annotations

from typing import Final
from urllib.parse import urlsplit

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from server.http.authentication import token_in
from server.http.over_tls import OverTls
from server.http.problem_kinds import WRONG_ORIGIN
from server.http.problems import problem
from server.runtime.settings import Settings

_SAFE: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_DEFAULT_PORTS: Final = {"http": 80, "https": 443}


def origin_allowed(connection: HTTPConnection, settings: Settings) -> bool:
    """True also without an Origin: the client is then not a browser, and no browser's cookies can be abused."""
    return origin_matches(
        origin=connection.headers.get("origin"),
        scheme="https" if OverTls(settings.public_url)(connection.scope) else "http",
        host=connection.headers.get("host", ""),
        public_url=settings.public_url,
    )


def origin_matches(*, origin: str | None, scheme: str, host: str, public_url: str = "") -> bool:
    """`scheme`, `host`: of the request as it left the browser. An origin consists of scheme, host and port."""
    if origin is None:
        return True
    came_from = _origin(origin)
    if came_from is None:
        return False
    allowed = {_origin(f"{scheme}://{host}")}
    if public_url:
        allowed.add(_origin(public_url))
    return came_from in allowed


def _origin(url: str) -> tuple[str, str, int] | None:
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        return None
    if not parts.hostname or parts.scheme not in _DEFAULT_PORTS:
        return None
    return parts.scheme, parts.hostname, port if port is not None else _DEFAULT_PORTS[parts.scheme]


class OriginCheck:
    """Checks every unsafe request: own origin or none. WebSockets call `origin_allowed` themselves,
    because a browser only learns a close code after the handshake.
    """

    def __init__(self, app: ASGIApp, *, settings: Settings) -> None:
        self._app = app
        self._settings = settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] in _SAFE:
            await self._app(scope, receive, send)
            return
        # Browsers add cookies to requests of other sites, but never a token; and with a token, cookies are ignored.
        connection = HTTPConnection(scope)
        if token_in(connection.headers) is None and not origin_allowed(connection, self._settings):
            await problem(WRONG_ORIGIN, instance=scope["path"])(scope, receive, send)
        else:
            await self._app(scope, receive, send)
