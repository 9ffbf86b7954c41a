"""Sends requests about a drone to its home tower, if that is another one. Plain ASGI, inside all other layers.

The list of drones is put together from all towers within reach.
"""

from __future__ import annotations

import asyncio
import json
import re
from typing import Any, Final

import structlog
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.http.problem_kinds import TOWER_OUT_OF_REACH
from server.http.problems import problem
from server.live.hub import Hub
from server.towers.api.asking import FORWARDED, Asking, NoAnswer
from server.towers.core.place import Place
from server.towers.core.towers import Towers
from server.towers.store.claims import Claims
from wire.ids import DroneId

LISTED_WITHIN_S: Final = 1.0
ANSWERED_WITHIN_S: Final = 3.0
NOT_FOUND: Final = 404
MAX_BODY_BYTES: Final = 500_000
"""More does not fit into a packet of the bus."""
_LIST: Final = "/api/v1/drones"
_ONE: Final = re.compile(r"/api/v1/drones/([0-9]{1,10})(?:/|$)")
_ALERT: Final = re.compile(r"/api/v1/alerts/([0-9]{1,16})/acknowledge")
_READS: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_log = structlog.get_logger(__name__)


class ToTheHome:
    def __init__(self, app: ASGIApp, hub: Hub, towers: Towers, claims: Claims, asking: Asking) -> None:
        self._app = app
        self._hub = hub
        self._towers = towers
        self._claims = claims
        self._asking = asking
        asking.app = self

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        if scope["path"] == _LIST and scope["method"] == "GET" and FORWARDED not in scope:
            await self._list(scope, receive, send)
            return
        alert = _ALERT.fullmatch(scope["path"])
        if alert is not None and FORWARDED not in scope and not self._hub.alerts.has(int(alert[1])):
            await self._acknowledge(scope, receive, send)
            return
        named = _ONE.match(scope["path"])
        drone_id = DroneId(int(named[1])) if named is not None else DroneId(0)
        drone = self._hub.state.drones.get(drone_id)
        if drone is None:
            await self._app(scope, receive, send)
            return
        if drone.place is Place.NOWHERE and scope["method"] not in _READS:
            await self._claims.claim_free(drone_id)
            await self._claims.learn()  # another tower may have been faster
        is_asked = FORWARDED in scope
        reads = scope["method"] in _READS
        home = self._towers.home_of(drone_id)
        if drone.place is Place.HERE or (reads and not is_asked and drone.place is not Place.ELSEWHERE):
            await self._app(scope, receive, send)
        elif is_asked or drone.place is not Place.ELSEWHERE or home is None:
            words = "the tower that has this drone is not within reach; the drone holds if nobody flies it: try again"
            await self._refuse(scope, receive, send, words)
        else:
            await self._forward(home, scope, receive, send)

    async def _forward(self, home: str, scope: Scope, receive: Receive, send: Send) -> None:
        body = await _body(receive)
        if body is None:
            return
        if len(body) > MAX_BODY_BYTES:
            words = "this request is too large for the bus: send it to the drone's own tower"
            await self._refuse(scope, receive, send, words)
            return
        try:
            status, headers, answer = await self._asking.ask(home, scope, body)
        except NoAnswer:
            words = "the tower that has this drone has not answered: check what became of the request"
            await self._refuse(scope, receive, send, words)
            return
        await send({"type": "http.response.start", "status": status, "headers": headers})
        await send({"type": "http.response.body", "body": answer})

    async def _acknowledge(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Of an alert that this tower does not have: the home of its drone does."""
        body = await _body(receive)
        if body is None:
            return
        asked = [self._asking.ask(one, scope, body, within_s=ANSWERED_WITHIN_S) for one in self._towers.ready()]
        for answer in await asyncio.gather(*asked, return_exceptions=True):
            if not isinstance(answer, BaseException) and answer[0] != NOT_FOUND:
                await send({"type": "http.response.start", "status": answer[0], "headers": answer[1]})
                await send({"type": "http.response.body", "body": answer[2]})
                return
        await self._app(scope, _again(body), send)

    async def _list(self, scope: Scope, receive: Receive, send: Send) -> None:
        status, start, body = 500, dict[str, Any](), bytearray()

        async def keep(message: Message) -> None:
            nonlocal status, start
            if message["type"] == "http.response.start":
                status, start = message["status"], dict(message)
            elif message["type"] == "http.response.body":
                body.extend(message.get("body", b""))

        towers = list(self._towers.ready())
        asked = [asyncio.create_task(self._asking.ask(one, scope, b"", within_s=LISTED_WITHIN_S)) for one in towers]
        try:
            await self._app(scope, receive, keep)
            answers = await asyncio.gather(*asked, return_exceptions=True)
        finally:
            for one in asked:
                one.cancel()
        if status == 200:
            views = {view["id"]: view for view in json.loads(bytes(body))}
            for tower, answer in zip(towers, answers, strict=True):
                if isinstance(answer, BaseException) or answer[0] != 200:
                    continue
                theirs = {view["id"]: view for view in json.loads(answer[2])}
                views |= {one: view for one, view in theirs.items() if self._towers.home_of(DroneId(one)) == tower}
            body = bytearray(json.dumps([view for _, view in sorted(views.items())]).encode())
            headers = [one for one in start["headers"] if one[0].lower() != b"content-length"]
            start["headers"] = [*headers, (b"content-length", b"%d" % len(body))]
        await send(start)
        await send({"type": "http.response.body", "body": bytes(body)})

    @staticmethod
    async def _refuse(scope: Scope, receive: Receive, send: Send, words: str) -> None:
        headers = {"Retry-After": "1"}
        await problem(TOWER_OUT_OF_REACH, instance=scope["path"], detail=words, headers=headers)(scope, receive, send)


def _again(body: bytes) -> Receive:
    async def receive() -> Message:
        return {"type": "http.request", "body": body, "more_body": False}

    return receive


async def _body(receive: Receive) -> bytes | None:
    """None: the client has gone."""
    body = bytearray()
    while True:
        message = await receive()
        if message["type"] != "http.request":
            return None
        body.extend(message.get("body", b""))
        if not message.get("more_body", False) or len(body) > MAX_BODY_BYTES:
            return bytes(body)
