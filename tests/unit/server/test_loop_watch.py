"""What holds the event loop is seen and named."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator

import pytest

from bench.rig import wait_for
from server.runtime.loop_watch import NOT_OURS, LoopWatch, _place
from wire.zones.area import Area
from wire.zones.track import Spot, Track


@pytest.fixture
async def watch() -> AsyncIterator[LoopWatch]:
    watch = LoopWatch()
    task = asyncio.create_task(watch.watch())
    yield watch
    task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await task


@pytest.mark.parametrize("idle_s", [0.0, 0.15])
async def test_work_that_holds_the_loop_is_named_with_its_time(watch: LoopWatch, idle_s: float) -> None:
    await asyncio.sleep(0.2)
    time.sleep(idle_s)  # noqa: ASYNC251 (the work begins after the first look, as on a busy machine)
    ring = tuple((47.0 + 0.001 * (n % 2), 8.0 + 0.0001 * n) for n in range(400))
    worked_s = time.process_time() + 0.4
    while time.process_time() < worked_s:
        Area(ring)
    await wait_for("the work that held the loop", watch.worst_hold)  # a busy machine may have held it before
    worst = watch.worst_hold()
    assert worst is not None
    assert worst.where.startswith("wire.zones.area.")
    assert worst.held_s > 0.3
    assert watch.worst_ms >= round(worst.held_s * 1000, 2)
    assert set(watch.held_s) >= {worst.where}


@pytest.mark.parametrize("route", ["server.airspace.api.list_zones", "server.fleet.api.loan_routes.lend"])
def test_the_route_is_named_and_not_what_it_calls(route: str) -> None:
    assert _place(["server.http.guards.__call__", route, "wire.zones.area.inside"]) == route
    assert _place(["server.link.api.live_channel.received", "wire.zones.area.inside"]) == "wire.zones.area.inside"


async def test_a_loop_that_waits_for_something_else_is_not_blamed_on_our_code(watch: LoopWatch) -> None:
    await asyncio.sleep(0.2)
    time.sleep(0.4)  # noqa: ASYNC251 (the loop is to stand still)
    await wait_for("the loop that stood still", lambda: watch.worst_ms >= 300)
    assert set(watch.held_s) == {NOT_OURS}
    assert watch.worst_hold() is None


async def test_a_loop_that_answers_is_nobodys_fault(watch: LoopWatch) -> None:
    for _ in range(5):
        await asyncio.sleep(0.06)
        assert Track(Spot(47, 8, 0, 0), Spot(47, 8, 0, 0)).length_m == 0
    assert watch.worst_hold() is None
    assert watch.now_ms >= 0
