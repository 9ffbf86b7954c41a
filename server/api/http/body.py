"""Limits request bodies: JSON only, bounded in size. Plain ASGI, before anything is read."""

from __future__ import annotations

import asyncio
import random
import re
from typing import Final

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.api.http.problems import BODY_TIMEOUT, JSON_ONLY, TOO_LARGE, problem
from server.live.anonymous.budget import AnonymousBudget, Over
from server.live.anonymous.limits import LIMITS

MAX_BODY_BYTES: Final = LIMITS.max_body_bytes
WITHIN_S: Final = LIMITS.body_within_s
SPREAD_S: Final = LIMITS.body_spread_s

_PLANS: Final = re.compile(r"/api/v1/(drones/\d+/((mission|fence|rally)(/verify)?|parameters)|missions(/\d+)?)")
_SIGN_IN: Final = frozenset(
    {"/api/v1/session", "/api/v1/session/passkey", "/api/v1/session/passkey/options", "/api/v1/enrol"}
)
_FILES: Final = re.compile(r"/api/v1/agent/files/\d+")


class BodyCheck:
    """Refuses a body whose headers announce too much. Without such headers it counts the received bytes. Gives up a
    body that does not arrive in full in time."""

    def __init__(self, app: ASGIApp, budget: AnonymousBudget) -> None:
        self._app = app
        self._budget = budget

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            headers = Headers(scope=scope)
            if _FILES.fullmatch(scope["path"]):  # an agent's upload is not JSON, and is counted where it is written
                await self._app(scope, receive, send)
                return
            most, within_s = _bounds(scope["path"])
            length = _length(headers)
            if length > most:
                self._budget.refused[Over.BODY] += 1
                await problem(TOO_LARGE, instance=scope["path"])(scope, receive, send)
                return
            if (length > 0 or "transfer-encoding" in headers) and not _is_json(headers):
                await problem(JSON_ONLY, instance=scope["path"])(scope, receive, send)
                return
            await self._app(scope, self._counted(receive, most, within_s), send)
        else:
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        length = _length(headers)
        if length == 0 and "transfer-encoding" not in headers:
            await self._app(scope, receive, send)
            return
        path = scope["path"]
        is_plan = _PLANS.fullmatch(path) is not None
        most, within_s = _bounds(path, is_plan=is_plan)
        if length > most:
            self._budget.refused[Over.BODY] += 1
            await problem(TOO_LARGE, instance=path)(scope, receive, send)
        elif not _is_json(headers):
            await problem(JSON_ONLY, instance=path)(scope, receive, send)
        else:
            bounded = self._bounded(receive, most, within_s)
            if is_plan:
                await self._app(scope, bounded, send)
                return
            try:
                body = await _whole_body(bounded)
            except HTTPException as refusal:
                kind = TOO_LARGE if refusal.status_code == TOO_LARGE.status else BODY_TIMEOUT
                await problem(kind, instance=path, headers=dict(refusal.headers or {}))(scope, receive, send)
                return
            if body is not None:
                await self._app(scope, _received(body, receive), send)

    def _bounded(self, receive: Receive, most: int, within_s: float) -> Receive:
        """`receive`, which raises HTTPException beyond these bounds."""
        taken, whole, refused = 0, False, self._budget.refused
        # Bodies that began together must not end together: two hundred responses at once delay a frame by 25 ms.
        until = asyncio.get_running_loop().time() + within_s + random.random() * SPREAD_S  # noqa: S311 (no secret)

        async def bounded() -> Message:
            nonlocal taken, whole
            try:
                async with asyncio.timeout_at(
                    None if whole else until
                ):  # afterwards `receive` waits for the end of the connection
                    message = await receive()
            except TimeoutError:
                refused[Over.BODY_TIME] += 1
                raise HTTPException(BODY_TIMEOUT.status, headers={"Connection": "close"}) from None
            taken += len(message.get("body", b""))
            whole = not message.get("more_body", False)
            if taken > most:
                refused[Over.BODY] += 1
                raise HTTPException(TOO_LARGE.status)  # raised in the route, so it becomes a problem document
            return message

        return bounded


def _bounds(path: str) -> tuple[int, float]:
    """Returns the maximum size of a body on this path in bytes, and its deadline in seconds."""
    if path in _SIGN_IN:
        return LIMITS.max_sign_in_body_bytes, min(LIMITS.sign_in_body_within_s, WITHIN_S)
    return LIMITS.max_plan_body_bytes if is_plan else MAX_BODY_BYTES, WITHIN_S


def _length(headers: Headers) -> int:
    text = headers.get("content-length", "0")
    return int(text) if text.isascii() and text.isdigit() else 0


def _is_json(headers: Headers) -> bool:
    return headers.get("content-type", "").partition(";")[0].strip().lower() == "application/json"
