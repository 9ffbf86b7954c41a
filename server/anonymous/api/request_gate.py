"""Limits the rate at which strangers' requests begin, in fair turns between networks. Plain ASGI, the outermost layer.

The client's address is known here even behind a trusted proxy: uvicorn has put it into the scope, and accepts
X-Forwarded-For only from `TOWER_TRUSTED_PROXIES`.
"""

from __future__ import annotations

import asyncio
import json
import time
from collections import OrderedDict
from collections.abc import Callable
from typing import Final

from starlette.types import ASGIApp, Receive, Scope, Send

from server.anonymous.api.anonymous_scope import ANONYMOUS_CONNECTION, ANONYMOUS_REQUEST, ON_ADMITTED
from server.anonymous.core.budget import AnonymousBudget, AnonymousRequest, Over
from server.anonymous.core.connections import AnonymousConnection
from server.anonymous.core.fair_queue import Bounds, FairQueue, Priority
from server.anonymous.core.networks import Origin, origin_of
from server.link.core.token_bucket import TokenBucket

RETRY_AFTER_S: Final = 5
MAX_REMEMBERED: Final = 1_000
"""Known addresses whose rate is remembered; the one idle for longest is evicted and starts afresh."""
_BEAT_S: Final = 0.01
_TYPE: Final = "/problems/too-many-requests"
_FORWARDED: Final = b"x-forwarded-for"


class _TooManyRequests(Exception):
    def __init__(self, over: Over) -> None:
        super().__init__(over.value)
        self.over = over


class RequestGate:
    """Wraps the application. `is_vouched`: tells from the request head alone whether the client has signed in."""

    def __init__(
        self, app: ASGIApp, budget: AnonymousBudget, is_vouched: Callable[[Scope], bool] = lambda scope: False
    ) -> None:
        limits = budget.limits
        self._app = app
        self._budget = budget
        self._is_vouched = is_vouched
        self._line = FairQueue[asyncio.Future[None]](
            Bounds(
                limits.max_waiting_requests_per_address,
                limits.max_waiting_requests_per_network,
                limits.max_waiting_requests,
                limits.known_address_factor,
            )
        )
        self._strangers: TokenBucket | None = None
        self._of_known: OrderedDict[str, TokenBucket] = OrderedDict()
        self._timer: asyncio.TimerHandle | None = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        anonymous: AnonymousConnection | None = scope.get(ANONYMOUS_CONNECTION)
        forwarded = anonymous is None or (
            anonymous.is_proxy and any(name == _FORWARDED for name, _ in scope["headers"])
        )
        on_admitted = scope.pop(ON_ADMITTED, _nothing)
        if anonymous is not None and anonymous.is_admitted and not forwarded:
            on_admitted()
            await self._app(scope, receive, send)
            return
        client = scope.get("client")
        origin = origin_of(client[0] if client else "")
        is_handshake = scope["type"] == "websocket"
        is_vouched = self._is_vouched(scope)
        try:
            if not is_vouched:
                await self._turn(origin)
            if (
                is_handshake
                and not is_vouched
                and not self._budget.begin_handshake(origin, is_known=self._budget.known.knows(origin))
            ):
                raise _TooManyRequests(Over.HANDSHAKES)
        except _TooManyRequests:
            await _refuse(scope, send)
            return
        request = AnonymousRequest(
            self._budget,
            origin,
            None if forwarded else anonymous,
            is_handshake=is_handshake and not is_vouched,
            on_admitted=on_admitted,
        )
        scope[ANONYMOUS_REQUEST] = request
        try:
            await self._app(scope, receive, send)
        finally:
            request.end()
            del scope[ANONYMOUS_REQUEST]

    async def _turn(self, origin: Origin) -> None:
        """Returns when this request may begin. Raises _TooManyRequests."""
        now = time.monotonic()
        standing = self._budget.standing(origin)
        if standing is Priority.KNOWN and self._pace_of(origin.address, now).take(1.0, now):
            return
        if not len(self._line) and self._pace(now).take(1.0, now):
            return
        waiting = asyncio.get_running_loop().create_future()
        ticket, pushed_out = self._line.join(waiting, origin, standing)
        if pushed_out is not None and not pushed_out.item.done():
            pushed_out.item.set_exception(_TooManyRequests(Over.REQUESTS))
        if ticket is None:
            self._budget.refused[Over.REQUESTS] += 1
            raise _TooManyRequests(Over.REQUESTS)
        self._plan()
        try:
            async with asyncio.timeout(self._budget.limits.request_wait_s):
                await waiting
        except TimeoutError:
            self._budget.refused[Over.REQUEST_TIME] += 1
            raise _TooManyRequests(Over.REQUEST_TIME) from None
        except _TooManyRequests:
            self._budget.refused[Over.REQUESTS] += 1
            raise
        finally:
            self._line.leave(ticket)
            self._budget.waiting["requests"] = len(self._line)

    def _pace(self, now: float) -> TokenBucket:
        if self._strangers is None:
            limits = self._budget.limits
            self._strangers = TokenBucket(limits.requests_per_s, limits.requests_burst, now)
        return self._strangers

    def _pace_of(self, address: str, now: float) -> TokenBucket:
        pace = self._of_known.get(address)
        if pace is None:
            limits = self._budget.limits
            pace = self._of_known[address] = TokenBucket(limits.known_requests_per_s, limits.known_requests_burst, now)
            if len(self._of_known) > MAX_REMEMBERED:
                self._of_known.popitem(last=False)
        self._of_known.move_to_end(address)
        return pace

    def _plan(self) -> None:
        self._budget.waiting["requests"] = len(self._line)
        if self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(_BEAT_S, self._beat)

    def _beat(self) -> None:
        self._timer = None
        now = time.monotonic()
        pace = self._pace(now)
        while len(self._line) and pace.take(1.0, now):
            ticket = self._line.call()
            if ticket is not None and not ticket.item.done():
                ticket.item.set_result(None)
        if len(self._line):
            self._plan()


def _nothing() -> None:
    pass


async def _refuse(scope: Scope, send: Send) -> None:
    """429, as a problem document; the connection is closed."""
    body = json.dumps(
        {
            "type": _TYPE,
            "title": "Too many requests",
            "status": 429,
            "detail": "too many requests: try again in a few seconds",
            "instance": scope["path"],
        }
    ).encode()
    headers = [
        (b"content-type", b"application/problem+json"),
        (b"content-length", str(len(body)).encode()),
        (b"retry-after", str(RETRY_AFTER_S).encode()),
    ]
    kind = "http.response"
    if scope["type"] == "websocket":
        if "websocket.http.response" not in scope.get("extensions", {}):
            await send({"type": "websocket.close"})
            return
        kind = "websocket.http.response"
    else:
        headers.append((b"connection", b"close"))
    await send({"type": f"{kind}.start", "status": 429, "headers": headers})
    await send({"type": f"{kind}.body", "body": body})
