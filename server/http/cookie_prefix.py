"""Over TLS the tower's cookies have the prefix `__Host-`: a browser then accepts them over TLS only, for this host
only, and not from a sibling domain. Elsewhere (a tower on the user's own machine) they keep the plain name, which
browsers send there.

The rest of the tower reads and sets plain names. Over TLS a cookie with a plain name cannot be trusted, because a
sibling domain or an attacker on the path can plant it: it is dropped and cleared.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.http.over_tls import OverTls

PREFIX: Final = b"__Host-"
_OURS: Final = b"tower_"
"""Prefix of all cookies of the tower."""
_CLEARED: Final = b"=; HttpOnly; Max-Age=0; Path=/; SameSite=strict; Secure"

Header = tuple[bytes, bytes]


class CookiePrefix:
    def __init__(self, app: ASGIApp, *, over_tls: OverTls) -> None:
        self._app = app
        self._over_tls = over_tls

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in {"http", "websocket"} or not self._over_tls(scope):
            await self._app(scope, receive, send)
            return
        headers, plain = _without_prefix(scope["headers"])

        async def send_with_prefix(message: Message) -> None:
            if message["type"] in {"http.response.start", "websocket.http.response.start"}:
                answered = [_with_prefix(one) for one in message.get("headers", ())]
                answered += [(b"set-cookie", name + _CLEARED) for name in plain]
                message = {**message, "headers": answered}
            await send(message)

        await self._app({**scope, "headers": headers}, receive, send_with_prefix)


def _without_prefix(headers: Iterable[Header]) -> tuple[list[Header], list[bytes]]:
    """Returns the headers as the rest of the tower reads them, and the names of our cookies that came without the
    prefix."""
    passed: list[Header] = []
    plain: list[bytes] = []
    for name, value in headers:
        if name != b"cookie":
            passed.append((name, value))
            continue
        pairs = []
        for pair in (one.strip() for one in value.split(b";")):
            key = pair.partition(b"=")[0]
            if key.startswith(_OURS):
                plain.append(key)
            else:
                pairs.append(pair.removeprefix(PREFIX) if key.startswith(PREFIX + _OURS) else pair)
        passed.append((name, b"; ".join(pairs)))
    return passed, list(dict.fromkeys(plain))[:8]


def _with_prefix(header: Header) -> Header:
    name, value = header
    if name.lower() != b"set-cookie" or not value.startswith(_OURS):
        return header
    pair, *attributes = [one.strip() for one in value.split(b";")]
    kept = [one for one in attributes if one.partition(b"=")[0].lower() not in {b"path", b"domain", b"secure"}]
    return name, b"; ".join((PREFIX + pair, *kept, b"Path=/", b"Secure"))
