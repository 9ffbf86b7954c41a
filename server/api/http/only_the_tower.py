"""Stops a process that may no longer be the tower from answering. Plain ASGI.

Either it was stopped for longer than its lock lasts and has not checked since, or another process has the lock.
Requests that waited in its sockets meanwhile must not be executed late.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocketClose

from server.api.http.problem_kinds import NOT_THE_TOWER
from server.api.http.problems import problem

TRY_AGAIN: Final = 1013
_DENIAL: Final = "websocket.http.response"
_WORDS: Final = "this process was stopped for a while, and another may be the tower: try again"


class OnlyTheTower:
    """`may_act`: whether this process may act as the tower. Called at the beginning of each request."""

    def __init__(self, app: ASGIApp, may_act: Callable[[], bool]) -> None:
        self._app = app
        self._may_act = may_act

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if self._may_act() or scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
        elif scope["type"] == "http" or _DENIAL in scope.get("extensions", {}):
            # To close a WebSocket before it is accepted would become a bare 403, which reads as a wrong key.
            headers = {"Retry-After": "1"}
            await problem(NOT_THE_TOWER, instance=scope["path"], detail=_WORDS, headers=headers)(scope, receive, send)
        else:
            await WebSocketClose(TRY_AGAIN, _WORDS)(scope, receive, send)
