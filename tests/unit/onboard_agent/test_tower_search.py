"""A link at the first of several towers that answers: one hello at a time, and none after one that succeeded."""

import asyncio
from typing import Any, cast

import pytest

from onboard_agent.link.tower_url import TowerUrl, parse_tower_url
from onboard_agent.sockets import tower_search
from onboard_agent.sockets.control_channel import CredentialRefused, NoLink, OpenedChannel
from onboard_agent.sockets.tower_search import HelloTurn, open_at_any

A, B, C = (parse_tower_url(f"https://{one}.example.org") for one in "abc")


class Towers:
    """`answers`: an error, or None for a tower that answers once `released`."""

    def __init__(self, **answers: NoLink | None) -> None:
        self.answers = answers
        self.hellos: list[str] = []
        self.tried: list[str] = []
        self.released = asyncio.Event()
        self.released.set()
        self.all_tried = asyncio.Event()

    async def open(self, url: TowerUrl, turn: HelloTurn) -> OpenedChannel:
        name = url.host[0]
        self.tried.append(name)
        if len(self.tried) == len(self.answers):
            self.all_tried.set()
        answer = self.answers.get(name, NoLink("unused"))
        if isinstance(answer, NoLink):
            raise answer
        await self.released.wait()
        async with turn:
            self.hellos.append(name)
            await asyncio.sleep(0)
        return cast("Any", name)


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tower_search, "NEXT_TOWER_AFTER_S", 0.001)


async def test_a_tower_that_fails_is_followed_by_the_next_at_once() -> None:
    towers = Towers(a=NoLink("refused"), b=None)
    assert await open_at_any([A, B], towers.open, HelloTurn()) == (B, "b")


async def test_of_two_that_answer_at_once_only_one_gets_a_hello() -> None:
    towers = Towers(a=None, b=None, c=None)
    towers.released.clear()
    search = asyncio.create_task(open_at_any([A, B, C], towers.open, HelloTurn()))
    await towers.all_tried.wait()
    towers.released.set()
    found, _ = await search
    assert towers.hellos == [found.host[0]]


async def test_there_is_no_hello_if_none_is_wanted_any_more() -> None:
    async def heard_again() -> None:
        raise NoLink("the tower is heard again")

    towers = Towers(a=None)
    with pytest.raises(NoLink, match="heard again"):
        await open_at_any([A], towers.open, HelloTurn(heard_again))
    assert towers.hellos == []


async def test_only_a_refusal_by_all_is_a_refusal() -> None:
    refused, away = CredentialRefused("unknown key"), NoLink("no answer")
    with pytest.raises(CredentialRefused):
        await open_at_any([A, B], Towers(a=refused, b=refused).open, HelloTurn())
    with pytest.raises(NoLink, match="no answer"):
        await open_at_any([A, B], Towers(a=refused, b=away).open, HelloTurn())
    with pytest.raises(NoLink, match="no tower"):
        await open_at_any([], Towers().open, HelloTurn())
