"""Work that runs for the life of the tower and restarts after errors."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from typing import Final

import structlog

AGAIN_AFTER_S: Final = 1.0
_log = structlog.get_logger(__name__)


@asynccontextmanager
async def in_background(
    name: str, work: Callable[[], Awaitable[None]], *, again_after_s: float = AGAIN_AFTER_S
) -> AsyncIterator[None]:
    """Runs `work` until the block ends. Logs a failure and starts it again: a tower that no longer checks for withdrawn
    rights or expired loans must not look healthy."""

    async def for_ever() -> None:
        while True:
            try:
                await work()
            except Exception:
                _log.exception("background_work_failed", what=name)
            await asyncio.sleep(again_after_s)

    task = asyncio.create_task(for_ever(), name=name)
    try:
        yield
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
