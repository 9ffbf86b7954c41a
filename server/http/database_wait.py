"""Bounds the time that a request waits for a failing database in total, not per query. Plain ASGI."""

from __future__ import annotations

import asyncio
from typing import Final

import structlog
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.http.problem_kinds import DATABASE
from server.http.problems import problem
from server.storage.database import Database
from server.storage.database_wait import EndingTasks

_log = structlog.get_logger(__name__)
_WORDS: Final = "the database did not answer in time"


class BoundedDatabaseWait:
    """Answers for a request that hangs in its database. An open WebSocket lasts for hours and gets the bound for each
    query."""

    def __init__(self, app: ASGIApp, database: Database) -> None:
        self._app = app
        self._database = database
        self._ending = EndingTasks()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        started = given_up = False

        async def watch(message: Message) -> None:
            nonlocal started
            if not given_up:
                started = True
                await send(message)

        async def work() -> None:
            await self._app(scope, receive, watch)

        with self._database.bounded_wait() as wait:
            working = asyncio.create_task(work())
            try:
                await asyncio.wait({working, wait.overdue}, return_when=asyncio.FIRST_COMPLETED)
                given_up = not working.done() and not started
                if not given_up:
                    await working
            finally:
                if not working.done():
                    self._ending.let_end(working)
            if given_up:
                _log.error("database_unavailable", path=scope["path"], error=_WORDS)
                headers = {"Retry-After": "1"}
                answer = problem(DATABASE, instance=scope["path"], detail=_WORDS, headers=headers)
                await answer(scope, receive, send)
