"""Runs the converter of flight files: one at a time, in a process of its own that sees none of the tower's secrets."""

from __future__ import annotations

import asyncio
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import msgspec

from server.live.flight_imports.converted import Converted
from server.live.flight_imports.refusals import BadFlightFile

MAX_DURATION_S: Final = 300.0
"""By the clock: at low priority beside a busy tower, 240 s of processor time take longer."""
_ROOT: Final = Path(__file__).resolve().parents[3]
_MAX_ANSWER_BYTES: Final = 256 * 1024
_MAX_WORDS: Final = 200


async def run_converter(source: Path, target: Path, uploaded_us: int) -> Converted:
    """Writes `target`, and removes it on failure. Raises BadFlightFile, OSError."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "server.store.flight_imports.converter"),
        *(str(source), str(target), str(uploaded_us)),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
        cwd=_ROOT,
        env={"PATH": os.defpath, "LANG": "C.UTF-8"},
    )
    assert process.stdout is not None
    done = False
    try:
        async with asyncio.timeout(MAX_DURATION_S):
            answer = await process.stdout.read(_MAX_ANSWER_BYTES)
            while more := await process.stdout.read(_MAX_ANSWER_BYTES):
                answer += more
                if len(answer) > _MAX_ANSWER_BYTES:
                    raise BadFlightFile("the file could not be read")
            code = await process.wait()
        if code == 0:
            found = msgspec.json.decode(answer, type=Converted)
            done = True
            return found
        problem = msgspec.json.decode(answer, type=dict[str, Any]).get("problem") if code == 1 and answer else None
        raise BadFlightFile(str(problem or "the file could not be read: it took too much time or memory")[:_MAX_WORDS])
    except TimeoutError:
        raise BadFlightFile("the file takes too long to read") from None
    except (msgspec.DecodeError, msgspec.ValidationError):
        raise BadFlightFile("the file could not be read") from None
    finally:
        with suppress(ProcessLookupError):
            process.kill()
        await process.wait()
        if not done:
            await asyncio.to_thread(target.unlink, missing_ok=True)
