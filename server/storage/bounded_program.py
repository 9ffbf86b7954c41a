"""Runs a program of the tower that reads files and answers with JSON: a process of its own with none of the tower's
secrets, ended when it takes too long or says too much. The program itself limits its memory and processor time."""

from __future__ import annotations

import asyncio
import os
import resource
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple

NICENESS: Final = 15
_ROOT: Final = Path(__file__).resolve().parents[2]


class TooMuchSaid(ValueError):
    """The answer is longer than the program may say."""


class Answered(NamedTuple):
    """`code`: negative where a limit ended it."""

    code: int
    answer: bytes


async def run_program(module: str, *arguments: str, within_s: float, max_bytes: int) -> Answered:
    """`python -m module arguments`. Raises TimeoutError, TooMuchSaid, OSError; the process has ended then."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", module, *arguments),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
        cwd=_ROOT,
        env={"PATH": os.defpath, "LANG": "C.UTF-8", "OPENBLAS_NUM_THREADS": "1"},
    )
    assert process.stdout is not None
    try:
        async with asyncio.timeout(within_s):
            answer = b""
            while more := await process.stdout.read(max_bytes):
                answer += more
                if len(answer) > max_bytes:
                    raise TooMuchSaid
            return Answered(await process.wait(), answer)
    finally:
        with suppress(ProcessLookupError):
            process.kill()
        await process.wait()


def limit_this_process(*, memory_bytes: int, processor_s: int, file_bytes: int = 0) -> None:
    """Called by the program first. `file_bytes`: how large a file it may write."""
    os.nice(NICENESS)
    resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes))
    resource.setrlimit(resource.RLIMIT_CPU, (processor_s, processor_s))
    resource.setrlimit(resource.RLIMIT_FSIZE, (file_bytes, file_bytes))
