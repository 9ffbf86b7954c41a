"""Has the MP4 of a recording made, by a process of its own that gives way to everything else."""

from __future__ import annotations

import asyncio
import os
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec

SILENCE_S: Final = 180.0
"""A process that says nothing for so long hangs. It speaks once a second, if the machine lets it run at all."""
MAX_DURATION_S: Final = 6 * 3600.0
"""For one file: the others wait for it. Two hours of the highest quality take a small computer less than two; a drone
that sends what no camera gives may keep it busy for days."""
HOPELESS: Final = 2
"""Its exit code where no other try will do better: not one picture came."""
_ROOT: Final = Path(__file__).resolve().parents[3]
_MAX_TEXT_LENGTH: Final = 150


@dataclass(frozen=True)
class Finished:
    """What is in the file. Pixels; `pictures` that could be read."""

    duration_s: float
    width: int
    height: int
    pictures: int


class CannotFinish(Exception):
    """The message is for people. `hopeless`: another try will not do better."""

    def __init__(self, words: str, *, hopeless: bool = False) -> None:
        super().__init__(words)
        self.words = words
        self.hopeless = hopeless


async def make_mp4(source: Path, target: Path) -> Finished:
    """Writes `target`; removes it where that does not work out. Raises CannotFinish, OSError."""
    # Nothing of the tower's environment: it reads what a drone sent, and has no business with the tower's secrets.
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "server.store.recordings.make_mp4", str(source), str(target)),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
        cwd=_ROOT,
        env={"PATH": os.defpath, "LANG": "C.UTF-8"},
    )
    assert process.stdout is not None
    last: dict[str, Any] = {}
    done = False
    try:
        async with asyncio.timeout(MAX_DURATION_S) as whole:
            while line := await asyncio.wait_for(process.stdout.readline(), SILENCE_S):
                last = msgspec.json.decode(line, type=dict[str, Any])
            code = await asyncio.wait_for(process.wait(), SILENCE_S)
        if code != 0:
            words = str(last.get("problem", "")) or f"the program that makes the file ended with {code}"
            raise CannotFinish(words[:_MAX_TEXT_LENGTH], hopeless=code == HOPELESS)
        finished = Finished(last["duration_s"], last["width"], last["height"], last["pictures"])
        done = True
        return finished
    except TimeoutError:
        raise CannotFinish(
            f"the program that makes the file {'takes too long' if whole.expired() else 'hangs'}"
        ) from None
    except (msgspec.DecodeError, KeyError, ValueError):
        raise CannotFinish("the program that makes the file said nothing that can be read") from None
    finally:
        with suppress(ProcessLookupError):
            process.kill()
        await process.wait()
        if not done:
            await asyncio.to_thread(target.unlink, missing_ok=True)
