"""What a request takes of the event loop is timed in its own steps, and charged to whoever made it."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import pytest
from starlette.requests import HTTPConnection

from server.http.request_cost import Clocked, Cost, RequestCost, pays
from server.http.request_shares import RequestShares
from server.kernel.shares import ShareName, Shares
from wire.ids import UserId

SCOPE = {"type": "http", "method": "GET", "path": "/", "headers": []}


def busy(seconds: float) -> None:
    until = time.thread_time() + seconds
    while time.thread_time() < until:
        pass


async def test_its_steps_count_and_its_waiting_and_others_do_not() -> None:
    cost, came = Cost(), asyncio.Event()

    async def request() -> None:
        busy(0.02)
        await came.wait()
        busy(0.03)

    async def another() -> None:
        busy(0.2)
        came.set()

    await asyncio.gather(_await(Clocked(request(), cost)), another())
    assert 0.05 <= cost.seconds < 0.15


async def test_a_cancellation_and_an_error_are_the_requests_own() -> None:
    ended: list[str] = []

    async def patient() -> None:
        try:
            await asyncio.sleep(60)
        except asyncio.CancelledError:
            ended.append("cancelled")
            raise

    task = asyncio.create_task(_await(Clocked(patient(), Cost())))
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert ended == ["cancelled"]

    async def catches() -> None:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.0):
                await asyncio.sleep(60)
        raise ValueError("of the request")

    with pytest.raises(ValueError, match="of the request"):
        await Clocked(catches(), Cost())


@pytest.mark.parametrize("fails", [False, True])
async def test_whoever_was_admitted_pays_also_where_it_fails(fails: bool) -> None:
    shares = Shares()

    async def app(scope: Any, receive: Any, send: Any) -> None:
        pays(HTTPConnection(scope), UserId(7))
        busy(0.02)
        if fails:
            raise RuntimeError("no answer")

    async def nothing(*_: Any) -> Any:
        return {}

    served = RequestCost(app, shares=RequestShares(shares))
    if fails:
        with pytest.raises(RuntimeError):
            await served(dict(SCOPE), nothing, nothing)
    else:
        await served(dict(SCOPE), nothing, nothing)
    assert shares.used(ShareName.REQUEST_TIME)[7] >= 20


async def test_nobody_pays_for_a_stranger() -> None:
    shares = Shares()

    async def app(scope: Any, receive: Any, send: Any) -> None:
        busy(0.01)

    async def nothing(*_: Any) -> Any:
        return {}

    await RequestCost(app, shares=RequestShares(shares))(dict(SCOPE), nothing, nothing)
    assert not shares.used(ShareName.REQUEST_TIME)


async def _await(work: Clocked) -> None:
    await work
