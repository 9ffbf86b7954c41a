"""HTTP requests about drones of other towers: sent to the drone's home, carried out there, answered here.

The home authenticates, judges and records them like its own. So a change of the controls is done when the tower that
has the agent has fenced and ordered the hold.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from itertools import count
from typing import Final

import structlog
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Message, Scope

from server.http.authentication import VOUCHED
from server.kernel.people import Principal, SignInId
from server.runtime.request_id import begin_request, current_request_id
from server.towers.core.messages import Answer, Ask, attach_of, sign_in_of
from server.towers.core.towers import Towers
from wire.ids import UserId

ANSWERED_WITHIN_S: Final = 30.0
MAX_ANSWER_BYTES: Final = 8_000_000
CHUNK_BYTES: Final = 200_000
MAX_OPEN: Final = 500
"""Requests of all other towers that this one carries out at the same time."""
FORWARDED: Final = "tower.forwarded"
_log = structlog.get_logger(__name__)


class NoAnswer(Exception):
    """The other tower was lost, or has not answered in time. `sent`: it may have carried the request out."""


@dataclass
class _Open:
    tower: str
    done: asyncio.Future[tuple[int, list[tuple[bytes, bytes]], bytes]]
    status: int = 0
    headers: list[tuple[bytes, bytes]] = field(default_factory=list)
    body: bytearray = field(default_factory=bytearray)


class Asking:
    """Both halves, for one tower. `app`: carries out what the others ask; set once it is assembled."""

    def __init__(self, towers: Towers) -> None:
        self._towers = towers
        self._numbers = count(1)
        self._open: dict[int, _Open] = {}
        self._at_work: set[asyncio.Task[None]] = set()
        self.app: ASGIApp | None = None
        self.vouch: Callable[[HTTPConnection], tuple[Principal, int] | None] = lambda request: None
        """Who sends a request, as far as is known without the database, and the revision of the fleet then."""
        self.principal_of: Callable[[SignInId, UserId, datetime], Principal | None] = lambda *_: None
        """Who is signed in so, as this tower knows them: it does not believe what the other one says of them."""
        self.application: object = None
        """What handlers read as `request.app`."""
        towers.on_ask, towers.on_answer, towers.on_lost = self._asked, self._answered, self._lost

    async def ask(
        self, tower: str, scope: Scope, body: bytes, *, within_s: float = ANSWERED_WITHIN_S
    ) -> tuple[int, list[tuple[bytes, bytes]], bytes]:
        """Returns status, headers and body. Raises NoAnswer."""
        number = next(self._numbers)
        client = scope.get("client")
        known = self.vouch(HTTPConnection(scope))
        opened = self._open[number] = _Open(tower, asyncio.get_running_loop().create_future())
        self._towers.send(
            tower,
            Ask(
                number=number,
                method=scope["method"],
                path=scope["path"],
                query=scope["query_string"],
                headers=[(bytes(name), bytes(value)) for name, value in scope["headers"]],
                client=client[0] if client else "",
                body=body,
                known=attach_of(0, known[0], "") if known is not None else None,
                revision=known[1] if known is not None else 0,
                request_id=current_request_id(),
            ),
        )
        try:
            async with asyncio.timeout(within_s):
                return await opened.done
        except TimeoutError:
            raise NoAnswer from None
        finally:
            del self._open[number]

    async def stop(self) -> None:
        for task in self._at_work:
            task.cancel()
        await asyncio.gather(*self._at_work, return_exceptions=True)

    def _lost(self, tower: str) -> None:
        for opened in self._open.values():
            if opened.tower == tower and not opened.done.done():
                opened.done.set_exception(NoAnswer())

    def _answered(self, tower: str, answer: Answer) -> None:
        opened = self._open.get(answer.number)
        if opened is None or opened.tower != tower or opened.done.done():
            return
        if answer.status:
            opened.status, opened.headers = answer.status, answer.headers
        opened.body += answer.body
        if not answer.more:
            opened.done.set_result((opened.status, opened.headers, bytes(opened.body)))

    def _asked(self, tower: str, ask: Ask) -> None:
        if len(self._at_work) >= MAX_OPEN:
            self._towers.send(tower, Answer(ask.number, 503, [(b"retry-after", b"1")], b"", False))
            return
        task = asyncio.create_task(self._carry_out(tower, ask))
        self._at_work.add(task)
        task.add_done_callback(self._at_work.discard)

    async def _carry_out(self, tower: str, ask: Ask) -> None:
        status, headers, body = await self._run(ask)
        for start in range(0, max(len(body), 1), CHUNK_BYTES):
            more = start + CHUNK_BYTES < len(body)
            first = start == 0
            part = body[start : start + CHUNK_BYTES]
            self._towers.send(tower, Answer(ask.number, status if first else 0, headers if first else [], part, more))
            if more:
                await asyncio.sleep(0)  # sticks go between the parts

    async def _run(self, ask: Ask) -> tuple[int, list[tuple[bytes, bytes]], bytes]:
        assert self.app is not None
        begin_request(ask.request_id)
        status, headers, body = 500, [(b"content-length", b"0")], bytearray()
        received = False

        async def receive() -> Message:
            nonlocal received
            if received:
                await asyncio.Event().wait()  # the connection stays open
            received = True
            return {"type": "http.request", "body": ask.body, "more_body": False}

        async def send(message: Message) -> None:
            nonlocal status, headers
            if message["type"] == "http.response.start":
                status, headers = message["status"], [(bytes(n), bytes(v)) for n, v in message.get("headers", ())]
            elif message["type"] == "http.response.body" and len(body) <= MAX_ANSWER_BYTES:
                body.extend(message.get("body", b""))

        scope = {
            "type": "http",
            "app": self.application,
            "asgi": {"version": "3.0", "spec_version": "2.3"},
            "http_version": "1.1",
            "method": ask.method,
            "scheme": "http",
            "path": ask.path,
            "raw_path": ask.path.encode(),
            "query_string": ask.query,
            "root_path": "",
            "headers": ask.headers,
            "client": (ask.client, 0),
            "server": None,
            "state": {},
            "extensions": {},
            FORWARDED: True,
        }
        if ask.known is not None:
            known = ask.known
            found = self.principal_of(sign_in_of(known), UserId(known.user_id), known.expires_at)
            if found is not None:
                scope[VOUCHED] = found, ask.revision
        try:
            await self.app(scope, receive, send)
        except Exception:
            _log.exception("forwarded_request_failed", path=ask.path)
            return 500, [(b"content-length", b"0")], b""
        if len(body) > MAX_ANSWER_BYTES:
            text = b"this answer is too large for the bus: ask the drone's own tower"
            return 503, [(b"content-type", b"text/plain"), (b"content-length", b"%d" % len(text))], text
        return status, headers, bytes(body)
