"""The limit of time at the opening of the bus holds also for a library that loses a cancellation."""

import asyncio

import pytest

from server.towers.api import nats_bus
from server.towers.api.nats_bus import _within


async def loses_cancellations(count: int) -> None:
    for _ in range(count):
        try:
            await asyncio.sleep(60)
        except asyncio.CancelledError:
            continue
    await asyncio.sleep(60)


@pytest.mark.parametrize("lost", [0, 1, 3])
async def test_work_that_loses_cancellations_is_ended(lost: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nats_bus, "CANCEL_EVERY_S", 0.001)
    async with asyncio.timeout(10):
        with pytest.raises(TimeoutError, match="no answer"):
            await _within(loses_cancellations(lost), 0.01)


async def test_what_ends_in_time_ends_as_it_does() -> None:
    async def fails() -> None:
        raise OSError("no route")

    await _within(asyncio.sleep(0), 10)
    with pytest.raises(OSError, match="no route"):
        await _within(fails(), 10)


async def test_who_is_cancelled_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nats_bus, "CANCEL_EVERY_S", 0.001)
    before = asyncio.all_tasks()
    opening = asyncio.create_task(_within(loses_cancellations(1), 60))
    await asyncio.sleep(0)
    opening.cancel()
    with pytest.raises(asyncio.CancelledError):
        await opening
    assert asyncio.all_tasks() == before
