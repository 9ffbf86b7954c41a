"""Where passwords are hashed: in a separate process (a tower's), or in threads of this one (commands, tests)."""

from __future__ import annotations

import asyncio
import contextlib
import json
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from typing import Any, Protocol, cast

import structlog

from server.accounts.store.hash_worker import answer

_log = structlog.get_logger(__name__)


class HashingFailed(Exception):
    """No result: the process ended, or the stored hash is invalid."""


class Hashing(Protocol):
    async def ask(self, question: dict[str, Any]) -> str | bool:
        """See `hash_worker.answer`. Raises HashingFailed."""

    async def close(self) -> None:
        """Call it when the tower stops."""


class HashingThreads:
    """Hashes in this process."""

    def __init__(self, threads: int) -> None:
        self._threads = ThreadPoolExecutor(threads, "hashing")

    async def ask(self, question: dict[str, Any]) -> str | bool:
        return await asyncio.get_running_loop().run_in_executor(self._threads, answer, question)

    async def close(self) -> None:
        self._threads.shutdown(wait=False)


class HashingProcess:
    """Hashes in a process that starts with the first request, and restarts with the next one after it has ended."""

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._process: asyncio.subprocess.Process | None = None
        self._starting = asyncio.Lock()
        self._reading: asyncio.Task[None] | None = None
        self._asked: dict[int, asyncio.Future[str | bool]] = {}
        self._numbers = count()

    async def ask(self, question: dict[str, Any]) -> str | bool:
        async with self._starting:
            process = self._process
            if process is None or process.returncode is not None or self._reading is None or self._reading.done():
                process = await self._start()
        number = next(self._numbers)
        answered: asyncio.Future[str | bool] = asyncio.get_running_loop().create_future()
        self._asked[number] = answered
        try:
            assert process.stdin is not None
            process.stdin.write(json.dumps({"id": number, **question}).encode() + b"\n")
            return await answered
        except (BrokenPipeError, ConnectionResetError):
            raise HashingFailed from None
        finally:
            self._asked.pop(number, None)

    async def close(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        with contextlib.suppress(ProcessLookupError):
            process.kill()  # its caller is gone
        await process.wait()
        if self._reading is not None:
            await asyncio.gather(self._reading, return_exceptions=True)

    @property
    def pid(self) -> int | None:
        """The id of the process, while it runs."""
        return None if self._process is None else self._process.pid

    async def _start(self) -> asyncio.subprocess.Process:
        words = (sys.executable, "-m", "server.accounts.store.hash_worker", str(self._threads))
        pipe = asyncio.subprocess.PIPE
        self._process = process = await asyncio.create_subprocess_exec(*words, stdin=pipe, stdout=pipe)
        self._reading = asyncio.create_task(self._read(process), name="hashing")
        return process

    async def _read(self, process: asyncio.subprocess.Process) -> None:
        assert process.stdout is not None
        asked = self._asked
        async for line in process.stdout:
            reply = cast("dict[str, Any]", json.loads(line))
            answered = asked.get(reply["id"])
            if answered is not None and not answered.done():
                if "error" in reply:
                    answered.set_exception(HashingFailed(reply["error"]))
                else:
                    answered.set_result(reply["answer"])
        for answered in asked.values():
            if not answered.done():
                answered.set_exception(HashingFailed("its process has ended"))
        if self._process is process:
            _log.error("hashing_process_ended")
