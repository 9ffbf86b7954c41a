"""Catches unexpected errors. Plain ASGI."""

from __future__ import annotations

import structlog
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.http.problem_kinds import INTERNAL
from server.http.problems import problem

_log = structlog.get_logger(__name__)


class UnexpectedErrors:
    """Logs an unexpected error in full and reports it to the client in one sentence."""

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
                raise  # too late for a response: the server cuts the connection
            _log.exception("unexpected_error", method=scope["method"], path=scope["path"])
            await problem(INTERNAL, instance=scope["path"])(scope, receive, send)
