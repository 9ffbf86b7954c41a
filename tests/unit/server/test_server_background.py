"""Background tasks restart after a failure."""

import asyncio

from server.runtime.background import in_background


async def test_work_that_fails_begins_again_and_ends_with_the_block() -> None:
    tries: list[int] = []
    going_on, ended = asyncio.Event(), asyncio.Event()

    async def work() -> None:
        tries.append(len(tries))
        if len(tries) < 3:
            raise ValueError("what nobody thought of")
        going_on.set()
        try:
            await asyncio.Event().wait()
        finally:
            ended.set()

    async with in_background("a test", work, again_after_s=0.0):
        await asyncio.wait_for(going_on.wait(), 30.0)
        assert tries == [0, 1, 2]
        assert not ended.is_set()
    assert ended.is_set()
