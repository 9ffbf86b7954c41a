"""What surrounds every answer: security headers, and the last net under unexpected errors. Plain ASGI."""

from __future__ import annotations

from typing import Final

import structlog
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.problems import INTERNAL, problem


def content_security_policy(tiles_from: str | None = None) -> str:
    """What a page of ours may load. `tiles_from`: the one other origin, of map tiles, that an admin has set."""
    tiles = f" {tiles_from}" if tiles_from else ""
    return "; ".join(
        (
            "default-src 'self'",
            # Decoders of video are WebAssembly; it lets no text become code.
            "script-src 'self' 'wasm-unsafe-eval'",
            "style-src 'self'",
            f"img-src 'self' data: blob:{tiles}",
            "worker-src 'self'",
            f"connect-src 'self'{tiles}",
            "object-src 'none'",
            "base-uri 'none'",
            "frame-ancestors 'none'",
            "form-action 'self'",
        )
    )


_HEADERS: Final = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    # Old browsers know no frame-ancestors.
    "X-Frame-Options": "DENY",
    # A page of ours asks for a gamepad, the whole screen, and where the person is whom a drone is to follow; and for
    # nothing else that a browser could give.
    "Permissions-Policy": "gamepad=(self), fullscreen=(self), camera=(), microphone=(), geolocation=(self), usb=(), "
    "serial=(), payment=()",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
_log = structlog.get_logger(__name__)


class SecurityHeaders:
    def __init__(self, app: ASGIApp, *, api_prefix: str, tiles_from: str | None = None) -> None:
        self._app = app
        self._api_prefix = api_prefix
        self._headers = {"Content-Security-Policy": content_security_policy(tiles_from), **_HEADERS}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        is_api = scope["path"].startswith(self._api_prefix)

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in self._headers.items():
                    headers[name] = value
                if is_api:
                    headers.setdefault("Cache-Control", "no-store")
            await send(message)

        await self._app(scope, receive, send_with_headers)


class UnexpectedErrors:
    """An error that nobody expected: written to the log in full, told to the client in one sentence."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        started = False

        async def watch(message: Message) -> None:
            nonlocal started
            started = started or message["type"] == "http.response.start"
            await send(message)

        try:
            await self._app(scope, receive, watch)
        except Exception:
            if started:
                raise  # too late for an answer: the server cuts the connection
            _log.exception("unexpected_error", method=scope["method"], path=scope["path"])
            await problem(INTERNAL, instance=scope["path"])(scope, receive, send)
