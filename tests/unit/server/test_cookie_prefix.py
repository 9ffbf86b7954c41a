"""Which cookies pass, and under which name: over TLS and elsewhere, for requests and handshakes."""

import asyncio
from typing import Any

import pytest

from server.http.cookie_prefix import CookiePrefix
from server.http.over_tls import OverTls


def ask(cookies: bytes, sets: list[bytes], *, scheme: str = "https", kind: str = "http") -> tuple[bytes, list[bytes]]:
    """Returns the cookies that the application reads, and those that the browser is told to store."""
    read: list[bytes] = []
    sent: list[bytes] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        read.append(dict(scope["headers"]).get(b"cookie", b""))
        start = "http.response.start" if kind == "http" else "websocket.http.response.start"
        await send({"type": start, "status": 200, "headers": [(b"set-cookie", one) for one in sets]})

    async def send(message: Any) -> None:
        sent.extend(value for name, value in message["headers"] if name == b"set-cookie")

    scope = {"type": kind, "scheme": scheme, "headers": [(b"host", b"tower"), (b"cookie", cookies)]}
    asyncio.run(CookiePrefix(app, over_tls=OverTls(""))(scope, None, send))  # type: ignore[arg-type]
    return read[0], sent


@pytest.mark.parametrize(("kind", "scheme"), [("http", "https"), ("websocket", "wss")])
def test_over_tls_only_the_prefixed_one_is_read(kind: str, scheme: str) -> None:
    asked = b"a=1; __Host-tower_session=right; b=2;tower_session=planted ; __Host-other=3"
    read, sent = ask(asked, [], kind=kind, scheme=scheme)
    assert read == b"a=1; tower_session=right; b=2; __Host-other=3"
    assert sent == [b"tower_session=; HttpOnly; Max-Age=0; Path=/; SameSite=strict; Secure"]


def test_over_tls_what_is_set_gets_the_prefix_and_what_it_needs() -> None:
    sets = [
        b"tower_session=t; HttpOnly; Max-Age=9; Path=/; SameSite=strict",
        b"tower_passkey=p; Path=/api/v1/session; Domain=tower; SameSite=strict; secure",
        b"other=1; Path=/x",
    ]
    _, sent = ask(b"", sets)
    assert sent == [
        b"__Host-tower_session=t; HttpOnly; Max-Age=9; SameSite=strict; Path=/; Secure",
        b"__Host-tower_passkey=p; SameSite=strict; Path=/; Secure",
        b"other=1; Path=/x",
    ]


def test_without_tls_nothing_is_changed() -> None:
    asked, sets = b"tower_session=t; __Host-tower_session=other", [b"tower_session=t; Path=/"]
    assert ask(asked, sets, scheme="http") == (asked, sets)


def test_a_thousand_planted_ones_are_answered_with_a_few() -> None:
    planted = b"; ".join(b"tower_%d=x" % number for number in range(1000))
    read, sent = ask(planted, [])
    assert read == b"" and len(sent) == 8
