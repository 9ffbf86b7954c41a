"""A file that an agent uploads to the log store: streamed, counted, and only while an operation waits for it."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from typing import Final

from server.live.live_drone import LiveDrone
from server.logs.core import FileIncomplete, FileNotTaken, NotAskedFor
from server.logs.store.quota import FlightLogQuota
from server.operations.core.operation import Operation
from server.storage.file_accounts import FileAccounts
from server.storage.file_budget import StorageFull
from wire.transactions import LogDownloadWork

SILENCE_S: Final = 30.0
"""An agent that sends nothing for this long is gone; it starts over."""
MAX_REMEMBERED: Final = 1000
"""Transactions; many times what drones can send at one time."""
WRITE_AT_ONCE_BYTES: Final = 256 * 1024


class LogReceiver:
    """One instance per tower."""

    def __init__(self, quota: FlightLogQuota, accounts: FileAccounts) -> None:
        self._quota = quota
        self._accounts = accounts
        self._attempts: Counter[int] = Counter()
        """By transaction: a new attempt of an agent replaces the previous one."""

    async def receive(
        self, drone: LiveDrone, operation: Operation, size_bytes: int, body: AsyncIterator[bytes]
    ) -> None:
        """Raises NotAskedFor, FileNotTaken, FileIncomplete."""
        work, transaction_id = operation.step.work, operation.transaction_id
        if not isinstance(work, LogDownloadWork):
            raise NotAskedFor
        self._attempts[transaction_id] += 1
        attempt = self._attempts[transaction_id]
        while len(self._attempts) > MAX_REMEMBERED:
            del self._attempts[min(self._attempts)]

        def still_wanted() -> bool:
            current = operation.running and operation.transaction_id == transaction_id
            return current and self._attempts[transaction_id] == attempt

        quota, whose = self._quota, self._accounts()
        try:
            arriving = await asyncio.to_thread(quota.begin, drone.drone_id, transaction_id, size_bytes, attempt, whose)
        except StorageFull as error:
            raise FileNotTaken(str(error)) from None
        except OSError as error:
            raise FileNotTaken(f"the tower cannot keep files: {error.strerror or error}") from None
        try:
            taken, waiting = 0, bytearray()
            async for piece in _within(body, SILENCE_S):
                if not still_wanted():
                    raise NotAskedFor
                taken += len(piece)
                if taken > size_bytes:
                    raise FileIncomplete("more bytes came than announced")
                waiting += piece
                if len(waiting) >= WRITE_AT_ONCE_BYTES:
                    await asyncio.to_thread(quota.write, arriving, bytes(waiting))
                    waiting.clear()
            if taken != size_bytes:
                raise FileIncomplete(f"{taken} bytes came of {size_bytes}")
            await asyncio.to_thread(quota.write, arriving, bytes(waiting))
            if not still_wanted():
                raise NotAskedFor
            began = next((one.began_unix_s for one in drone.onboard.logs or () if one.log_id == work.log_id), None)
            await asyncio.to_thread(quota.keep, arriving, work.log_id, began)
        except StorageFull as error:
            raise FileNotTaken(str(error)) from None
        except OSError as error:
            raise FileNotTaken(f"the tower cannot keep it: {error.strerror or error}") from None
        finally:
            await asyncio.to_thread(quota.discard, arriving)


async def _within(body: AsyncIterator[bytes], silence_s: float) -> AsyncIterator[bytes]:
    while True:
        try:
            async with asyncio.timeout(silence_s):
                piece = await anext(body)
        except StopAsyncIteration:
            return
        except TimeoutError:
            raise FileIncomplete("the sender fell silent") from None
        yield piece
