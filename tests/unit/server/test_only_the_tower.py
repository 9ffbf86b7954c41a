"""A process that may not act as the tower says so, to requests and to agents, and asks them to come back."""

from __future__ import annotations

import json
from typing import Any

import pytest
from starlette.types import Message, Receive, Scope, Send

from server.http.only_the_tower import TRY_AGAIN, OnlyTheTower

DENIAL: dict[str, dict[str, str]] = {"websocket.http.response": {}}


async def answers(scope: dict[str, Any], *, may_act: bool, confirmed: bool = False) -> list[Message]:
    sent: list[Message] = []

    async def confirm() -> bool:
        assert not may_act, "a tower that may act asks nobody"
        return confirmed

    async def receive() -> Message:
        return {"type": "websocket.connect"}

    async def send(message: Message) -> None:
        sent.append(message)

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        await send({"type": "reached"})

    only = OnlyTheTower(app, may_act=lambda: may_act, confirmed=confirm)
    await only({"path": "/api/v1/agent", **scope}, receive, send)
    return sent


@pytest.mark.parametrize(
    ("scope", "kind"),
    [
        ({"type": "http", "method": "GET"}, "http.response"),
        ({"type": "websocket", "extensions": DENIAL}, "websocket.http.response"),
    ],
)
async def test_it_answers_503_in_words_with_a_time(scope: dict[str, Any], kind: str) -> None:
    start, body = await answers(scope, may_act=False)
    assert (start["type"], start["status"]) == (f"{kind}.start", 503)
    assert dict(start["headers"])[b"retry-after"] == b"1"
    document = json.loads(body["body"])
    assert document["type"] == "/problems/not-the-tower"
    assert "try again" in document["detail"]


async def test_a_server_that_cannot_answer_a_handshake_closes_it() -> None:
    (closed,) = await answers({"type": "websocket", "extensions": {}}, may_act=False)
    assert (closed["type"], closed["code"]) == ("websocket.close", TRY_AGAIN)


@pytest.mark.parametrize("kind", ["http", "websocket", "lifespan"])
async def test_the_tower_itself_passes_everything_on(kind: str) -> None:
    assert await answers({"type": kind}, may_act=True) == [{"type": "reached"}]
    assert (await answers({"type": "lifespan"}, may_act=False)) == [{"type": "reached"}]


@pytest.mark.parametrize("kind", ["http", "websocket"])
async def test_what_is_confirmed_meanwhile_is_answered(kind: str) -> None:
    assert await answers({"type": kind}, may_act=False, confirmed=True) == [{"type": "reached"}]


@pytest.mark.parametrize("path", ["/", "/assets/create_map-1.js", "/basemap/land.json"])
async def test_files_of_the_console_need_no_lock(path: str) -> None:
    assert await answers({"type": "http", "path": path}, may_act=False) == [{"type": "reached"}]
