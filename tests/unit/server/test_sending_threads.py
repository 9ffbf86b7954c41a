"""Places for work that waits for others: bounded in all and for each owner, free when the thread has ended."""

import asyncio
import threading

import pytest

from server.alerts.io.sending_threads import MAX_AT_ONCE, MAX_OF_ONE, SendingThreads

WITHIN_S = 30.0


async def test_one_owner_leaves_room_for_the_others() -> None:
    threads, gate = SendingThreads(), threading.Event()
    waiting = [threads.start(1, lambda: gate.wait(WITHIN_S) and None) for _ in range(MAX_OF_ONE)]
    assert (threads.full, threads.room) == ([1], MAX_AT_ONCE - MAX_OF_ONE)
    await asyncio.wait_for(threads.start(2, lambda: None), WITHIN_S)
    assert threads.room == MAX_AT_ONCE - MAX_OF_ONE
    gate.set()
    await asyncio.wait_for(asyncio.gather(*waiting), WITHIN_S)
    assert (threads.full, threads.room) == ([], MAX_AT_ONCE)


async def test_a_place_is_taken_until_its_thread_ends_whoever_waits() -> None:
    threads, gate = SendingThreads(), threading.Event()
    outcome = threads.start(1, lambda: gate.wait(WITHIN_S) and None)
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(outcome, 0.01)
    assert threads.room == MAX_AT_ONCE - 1
    gate.set()
    async with asyncio.timeout(WITHIN_S):
        while threads.room < MAX_AT_ONCE:  # noqa: ASYNC110
            await asyncio.sleep(0.001)


async def test_an_error_reaches_whoever_waits() -> None:
    def fails() -> None:
        raise OSError("gone")

    with pytest.raises(OSError, match="gone"):
        await asyncio.wait_for(SendingThreads().start(1, fails), WITHIN_S)
