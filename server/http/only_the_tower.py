"""Stops a process that may no longer be the tower from answering. Plain ASGI.

Either it was stopped for longer than its lock lasts and has not checked since, or another process has the lock.
Requests that waited in its sockets meanwhile must not be executed late. So they wait for the lock's next check if
nobody else is there to take it, and are refused if that does not come soon. Files of the console are the same whoever
serves them, and need no lock.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Final

from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocketClose

from server.http.problem_kinds import NOT_THE_TOWER
from server.http.problems import problem

TRY_AGAIN: Final = 1013
_API: Final = "/api/"
_DENIAL: Final = "websocket.http.response"
_WORDS: Final = "this process was stopped for a while, and another may be the tower: try again"


class OnlyTheTower:
    """`may_act`: whether this process may act as the tower. Called at the beginning of each request. `confirmed`: the
    same, after a check that is under way."""

    def __init__(self, app: ASGIApp, may_act: Callable[[], bool], confirmed: Callable[[], Awaitable[bool]]) -> None:
        self._app = app
        self._may_act = may_act
        self._confirmed = confirmed

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        is_file = scope["type"] == "http" and not scope["path"].startswith(_API)
        if scope["type"] not in ("http", "websocket") or is_file or self._may_act() or await self._confirmed():
            await self._app(scope, receive, send)
        elif scope["type"] == "http" or _DENIAL in scope.get("extensions", {}):
            # To close a WebSocket before it is accepted would become a bare 403, which reads as a wrong key.
            headers = {"Retry-After": "1"}
            await problem(NOT_THE_TOWER, instance=scope["path"], detail=_WORDS, headers=headers)(scope, receive, send)
        else:
            await WebSocketClose(TRY_AGAIN, _WORDS)(scope, receive, send)
