"""What may be in a request: JSON, and not much of it. Plain ASGI, before anything is read."""

from __future__ import annotations

from typing import Final

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.problems import JSON_ONLY, TOO_LARGE, problem

LARGEST_BODY_BYTES: Final = 64 * 1024
"""No request of the API comes near; whatever does is a mistake or an attack."""


class BodyCheck:
    """Turns down what the headers promise, where they do; counts what really comes, where they do not."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            headers = Headers(scope=scope)
            length = _length(headers)
            if length > LARGEST_BODY_BYTES:
                await problem(TOO_LARGE, instance=scope["path"])(scope, receive, send)
                return
            if (length > 0 or "transfer-encoding" in headers) and not _is_json(headers):
                await problem(JSON_ONLY, instance=scope["path"])(scope, receive, send)
                return
            await self._app(scope, _counted(receive), send)
        else:
            await self._app(scope, receive, send)


def _counted(receive: Receive) -> Receive:
    taken = 0

    async def counted() -> Message:
        nonlocal taken
        message = await receive()
        taken += len(message.get("body", b""))
        if taken > LARGEST_BODY_BYTES:
            raise HTTPException(TOO_LARGE.status)  # in the route that reads, so it becomes a problem document
        return message

    return counted


def _length(headers: Headers) -> int:
    text = headers.get("content-length", "0")
    return int(text) if text.isascii() and text.isdigit() else 0


def _is_json(headers: Headers) -> bool:
    return headers.get("content-type", "").partition(";")[0].strip().lower() == "application/json"
