"""Runs the converter of flight files: one at a time, in a process of its own that sees none of the tower's secrets."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any, Final

import msgspec

from server.flights.core.imports.converted import Converted
from server.flights.core.imports.refusals import BadFlightFile
from server.storage.bounded_program import TooMuchSaid, run_program

MAX_DURATION_S: Final = 300.0
"""By the clock: at low priority beside a busy tower, 240 s of processor time take longer."""
SMALL_S: Final = 60.0
S_PER_MB: Final = 6.0
"""A small file must not keep others waiting for as long as a large one may."""
_PROGRAM: Final = "server.flights.store.imports.converter"
_MAX_ANSWER_BYTES: Final = 256 * 1024
_MAX_WORDS: Final = 200


async def run_converter(source: Path, target: Path, uploaded_us: int) -> Converted:
    """Writes `target`, and removes it on failure. Raises BadFlightFile, OSError."""
    arguments = str(source), str(target), str(uploaded_us)
    done = False
    try:
        size_mb = (await asyncio.to_thread(source.stat)).st_size / 1e6
        within_s = min(SMALL_S + S_PER_MB * size_mb, MAX_DURATION_S)
        code, answer = await run_program(_PROGRAM, *arguments, within_s=within_s, max_bytes=_MAX_ANSWER_BYTES)
        if code == 0:
            found = msgspec.json.decode(answer, type=Converted)
            done = True
            return found
        problem = msgspec.json.decode(answer, type=dict[str, Any]).get("problem") if code == 1 and answer else None
        raise BadFlightFile(str(problem or "the file could not be read: it took too much time or memory")[:_MAX_WORDS])
    except TimeoutError:
        raise BadFlightFile("the file takes too long to read") from None
    except (TooMuchSaid, msgspec.DecodeError, msgspec.ValidationError):
        raise BadFlightFile("the file could not be read") from None
    finally:
        if not done:
            await asyncio.to_thread(target.unlink, missing_ok=True)
