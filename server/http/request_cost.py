"""The processor time that a request takes of the event loop, charged to whoever made it (`request_shares`).

The time is that of the loop's thread in the steps of the request's own task; the threads and processes that some
requests wait for charge theirs themselves.
"""

from __future__ import annotations

import time
from collections.abc import Coroutine, Generator
from dataclasses import dataclass
from typing import Any, Final

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from server.http.request_shares import RequestShares
from wire.ids import UserId

COST: Final = "tower.cost"


@dataclass(slots=True)
class Cost:
    """Of one request. `of`: who pays; nobody pays for what flies, and for what came from nobody known."""

    seconds: float = 0.0
    of: UserId | None = None


class Clocked:
    """A coroutine whose steps are timed."""

    def __init__(self, work: Coroutine[Any, Any, None], cost: Cost) -> None:
        self._work = work
        self._cost = cost

    def __await__(self) -> Generator[Any, Any, None]:
        step: Any = self._work.send
        given: Any = None
        while True:
            began = time.thread_time()
            try:
                wanted = step(given)
            except StopIteration:
                return
            finally:
                self._cost.seconds += time.thread_time() - began
            try:
                given = yield wanted
                step = self._work.send
            except BaseException as error:  # a cancellation too: it is the coroutine's, not ours
                given, step = error, self._work.throw


class RequestCost:
    """The outermost middleware."""

    def __init__(self, app: ASGIApp, *, shares: RequestShares) -> None:
        self._app = app
        self._shares = shares

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        cost = scope[COST] = Cost()
        work = self._app(scope, receive, send)
        assert isinstance(work, Coroutine)
        try:
            await Clocked(work, cost)
        finally:
            if cost.of is not None:
                self._shares.spent(cost.of, cost.seconds)


def pays(connection: HTTPConnection, user_id: UserId) -> None:
    """This person pays for the request."""
    cost: Cost | None = connection.scope.get(COST)
    if cost is not None:
        cost.of = user_id
