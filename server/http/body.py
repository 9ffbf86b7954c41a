"""Reads the body of a request: JSON only, of bounded size, within a deadline. Plain ASGI."""

from __future__ import annotations

import asyncio
import random
import re
from typing import Final

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.anonymous.core.budget import AnonymousBudget, Over
from server.anonymous.core.limits import LIMITS
from server.http.problem_kinds import BODY_TIMEOUT, JSON_ONLY, TOO_LARGE
from server.http.problems import problem

MAX_BODY_BYTES: Final = LIMITS.max_body_bytes
WITHIN_S: Final = LIMITS.body_within_s
SPREAD_S: Final = LIMITS.body_spread_s

MAX_COLONS: Final = 1_500
"""More fields than any request of ours has: each that is not known costs ten microseconds of the event loop."""

_PLANS: Final = re.compile(
    r"/api/v1/(drones/\d+/((mission|fence|rally)(/(verify|kept))?|parameters)|missions(/\d+)?|zones/shapes)"
)
_SIGN_IN: Final = frozenset(
    {"/api/v1/session", "/api/v1/session/passkey", "/api/v1/session/passkey/options", "/api/v1/enrol"}
)
_FILES: Final = re.compile(r"/api/v1/(agent/files/\d+|map/(?:files|elevation)/[^/]+|flight-imports)")


class BodyCheck:
    """Refuses bodies beyond a number of bytes, of fields, or a deadline.

    It reads a body whole before the application runs, so that a slow one holds no route and no dependency. Bodies of
    plans and parameters are larger: their routes read them after authentication.
    """

    def __init__(self, app: ASGIApp, budget: AnonymousBudget) -> None:
        self._app = app
        self._budget = budget

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        # Files of agents, maps and flights: not JSON, and their routes count the bytes while they write them.
        if scope["type"] != "http" or _FILES.fullmatch(scope["path"]):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        length = _length(headers)
        if length == 0 and "transfer-encoding" not in headers:
            await self._app(scope, receive, send)
            return
        path = scope["path"]
        most, within_s = bounds(path)
        if length > most:
            self._budget.refused[Over.BODY] += 1
            await problem(TOO_LARGE, instance=path)(scope, receive, send)
        elif not _is_json(headers):
            await problem(JSON_ONLY, instance=path)(scope, receive, send)
        else:
            bounded = self._bounded(receive, most, within_s)
            if _is_plan(path):
                await self._app(scope, bounded, send)
                return
            try:
                body = await _whole_body(bounded)
            except HTTPException as refusal:
                kind = TOO_LARGE if refusal.status_code == TOO_LARGE.status else BODY_TIMEOUT
                await problem(kind, instance=path, headers=dict(refusal.headers or {}))(scope, receive, send)
                return
            if body is not None and body.count(b":") > MAX_COLONS:
                self._budget.refused[Over.BODY] += 1
                await problem(TOO_LARGE, instance=path, detail="the body has too many fields")(scope, receive, send)
            elif body is not None:
                await self._app(scope, _received(body, receive), send)

    def _bounded(self, receive: Receive, most: int, within_s: float) -> Receive:
        """`receive`, which raises HTTPException beyond these bounds."""
        taken, whole, refused = 0, False, self._budget.refused
        # Bodies that began together must not end together: two hundred answers at once delay a frame by 25 ms.
        until = asyncio.get_running_loop().time() + within_s + random.random() * SPREAD_S  # noqa: S311 (no secret)

        async def bounded() -> Message:
            nonlocal taken, whole
            try:
                # After the body, `receive` waits for the end of the connection.
                async with asyncio.timeout_at(None if whole else until):
                    message = await receive()
            except TimeoutError:
                refused[Over.BODY_TIME] += 1
                raise HTTPException(BODY_TIMEOUT.status, headers={"Connection": "close"}) from None
            taken += len(message.get("body", b""))
            whole = not message.get("more_body", False)
            if taken > most:
                refused[Over.BODY] += 1
                raise HTTPException(TOO_LARGE.status)
            return message

        return bounded


async def _whole_body(receive: Receive) -> bytes | None:
    """None if the client has left."""
    body = bytearray()
    while True:
        message = await receive()
        if message["type"] == "http.disconnect":
            return None
        body += message.get("body", b"")
        if not message.get("more_body", False):
            return bytes(body)


def _received(body: bytes, receive: Receive) -> Receive:
    """Returns the body once, then waits for the end of the connection as `receive` does."""
    first: Message | None = {"type": "http.request", "body": body, "more_body": False}

    async def received() -> Message:
        nonlocal first
        message, first = first, None
        return message or await receive()

    return received


def bounds(path: str) -> tuple[int, float]:
    """The largest body in bytes, and the deadline in seconds."""
    if path in _SIGN_IN:
        return LIMITS.max_sign_in_body_bytes, min(LIMITS.sign_in_body_within_s, WITHIN_S)
    return LIMITS.max_plan_body_bytes if _is_plan(path) else MAX_BODY_BYTES, WITHIN_S


def _is_plan(path: str) -> bool:
    return _PLANS.fullmatch(path) is not None


def _length(headers: Headers) -> int:
    text = headers.get("content-length", "0")
    return int(text) if text.isascii() and text.isdigit() else 0


def _is_json(headers: Headers) -> bool:
    return headers.get("content-type", "").partition(";")[0].strip().lower() == "application/json"
