"""What may be in a request: JSON, and not much of it. Plain ASGI, before anything is read."""

from __future__ import annotations

import asyncio
import re
from typing import Final

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.problems import JSON_ONLY, TOO_LARGE, problem

LARGEST_BODY_BYTES: Final = 64 * 1024
"""No other request of the API comes near; whatever does is a mistake or an attack."""

LARGEST_PLAN_BYTES: Final = 512 * 1024
"""Mission, fence and rally points of 724 items each, or 4096 parameters, with room to be written widely. Such a body is
read only when it is known who sends it."""
WITHIN_S: Final = 30.0
"""In which a body must be whole. Half a megabyte needs 4 s at 1 Mbit/s; whoever sends byte by byte would keep memory
and a connection for ever."""
_TIMEOUT: Final = 408

_PLANS: Final = re.compile(r"/api/v1/(drones/\d+/((mission|fence|rally)(/verify)?|parameters)|missions(/\d+)?)")
_FILES: Final = re.compile(r"/api/v1/agent/files/\d+")


class BodyCheck:
    """Turns down what the headers promise, where they do; counts what really comes, where they do not,
    and gives up what does not come to its end."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            headers = Headers(scope=scope)
            if _FILES.fullmatch(scope["path"]):  # an agent's, which is no JSON and is counted where it is written
                await self._app(scope, receive, send)
                return
            most = LARGEST_PLAN_BYTES if _PLANS.fullmatch(scope["path"]) else LARGEST_BODY_BYTES
            length = _length(headers)
            if length > most:
                await problem(TOO_LARGE, instance=scope["path"])(scope, receive, send)
                return
            if (length > 0 or "transfer-encoding" in headers) and not _is_json(headers):
                await problem(JSON_ONLY, instance=scope["path"])(scope, receive, send)
                return
            await self._app(scope, _counted(receive, most), send)
        else:
            await self._app(scope, receive, send)


def _counted(receive: Receive, most: int) -> Receive:
    taken, whole = 0, False
    until = asyncio.get_running_loop().time() + WITHIN_S

    async def counted() -> Message:
        nonlocal taken, whole
        try:
            async with asyncio.timeout_at(
                None if whole else until
            ):  # afterwards it waits for the end of the connection
                message = await receive()
        except TimeoutError:
            raise HTTPException(_TIMEOUT, headers={"Connection": "close"}) from None
        taken += len(message.get("body", b""))
        whole = not message.get("more_body", False)
        if taken > most:
            raise HTTPException(TOO_LARGE.status)  # in the route that reads, so it becomes a problem document
        return message

    return counted


def _length(headers: Headers) -> int:
    text = headers.get("content-length", "0")
    return int(text) if text.isascii() and text.isdigit() else 0


def _is_json(headers: Headers) -> bool:
    return headers.get("content-type", "").partition(";")[0].strip().lower() == "application/json"
