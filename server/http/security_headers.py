"""The security headers of every response, in one table. Plain ASGI."""

from __future__ import annotations

from typing import Final, NamedTuple

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.http.over_tls import OverTls


def content_security_policy() -> str:
    """Returns what the console's pages may load: nothing from elsewhere, map tiles included."""
    return "; ".join(
        (
            "default-src 'self'",
            # Video decoders are WebAssembly; this does not let text become code.
            "script-src 'self' 'wasm-unsafe-eval'",
            "style-src 'self'",
            "img-src 'self' data: blob:",
            "worker-src 'self'",
            "connect-src 'self'",
            "object-src 'none'",
            "base-uri 'none'",
            "frame-ancestors 'none'",
            "form-action 'self'",
        )
    )


class Header(NamedTuple):
    name: str
    value: str
    why: str
    tls_only: bool = False
    """Sent only where the request came over TLS: browsers ignore it elsewhere."""


TABLE: Final = (
    Header("X-Content-Type-Options", "nosniff", "a file is what its type says"),
    Header("Referrer-Policy", "no-referrer", "no other site learns which drone was looked at"),
    Header("X-Frame-Options", "DENY", "old browsers know no frame-ancestors"),
    Header(
        "Permissions-Policy",
        # The console uses a gamepad, full screen, and the position of the person whom a drone follows.
        "gamepad=(self), fullscreen=(self), geolocation=(self), camera=(), microphone=(), usb=(), serial=(), "
        "payment=(), bluetooth=(), hid=(), midi=(), display-capture=()",
        "nothing else that a browser could give",
    ),
    Header("Cross-Origin-Opener-Policy", "same-origin", "no other site has a handle on a window of ours"),
    Header("Cross-Origin-Resource-Policy", "same-origin", "no other site embeds what is ours"),
    Header("X-Permitted-Cross-Domain-Policies", "none", "no policy files of old plug-ins"),
    Header(
        "Strict-Transport-Security",
        "max-age=31536000",
        "a browser that came over TLS once does not come without it for a year",
        tls_only=True,
    ),
)
"""Without the content security policy, which depends on the settings."""


class SecurityHeaders:
    def __init__(self, app: ASGIApp, *, api_prefix: str, over_tls: OverTls) -> None:
        self._app = app
        self._api_prefix = api_prefix
        self._over_tls = over_tls
        self._policy = content_security_policy()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        is_api = scope["path"].startswith(self._api_prefix)
        is_tls = self._over_tls(scope)

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers["Content-Security-Policy"] = self._policy
                for one in TABLE:
                    if is_tls or not one.tls_only:
                        headers[one.name] = one.value
                if is_api:
                    headers.setdefault("Cache-Control", "no-store")
            await send(message)

        await self._app(scope, receive, send_with_headers)
