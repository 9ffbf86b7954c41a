"""The process that looks for the landing pad, seen from the flight process: starts it, reads its lines, ends it.

Nothing here waits for the child. It is started again if it ends while it is wanted.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import sys
from typing import Final

import msgspec

from onboard_agent.landing.sighting_line import MAX_LINE_BYTES, SightingLine, decode_line

_log = logging.getLogger(__name__)

COMMAND: Final = (sys.executable, "-m", "onboard_agent.landing")
AGAIN_S: Final = 2.0
MAX_SIGHTINGS: Final = 50
"""Between two ticks of the agent; the oldest are dropped, because only the newest counts."""


class PadWatch:
    """A PadPort. Create it inside a running event loop."""

    def __init__(self, pad: str, camera: str, command: tuple[str, ...] = COMMAND) -> None:
        self._command = (*command, pad, camera)
        self._loop = asyncio.get_running_loop()
        self._task: asyncio.Task[None] | None = None
        self._sightings: list[SightingLine] = []
        self.pid: int | None = None
        """Process id of the running child."""

    def look(self, wanted: bool) -> None:
        """Starts the process, or ends it."""
        if wanted and self._task is None:
            self._task = self._loop.create_task(self._live())
        elif not wanted and self._task is not None:
            self._task.cancel()
            self._task = None

    def sightings(self) -> list[SightingLine]:
        """Returns those since the last call, in order."""
        sightings, self._sightings = self._sightings, []
        return sightings

    async def _live(self) -> None:
        while True:
            try:
                process = await asyncio.create_subprocess_exec(
                    *self._command,
                    stdin=asyncio.subprocess.DEVNULL,
                    stdout=asyncio.subprocess.PIPE,
                    limit=MAX_LINE_BYTES,
                    env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
                )
            except OSError as error:
                _log.error("the process that looks for the landing pad cannot be started: %s", error)
                await asyncio.sleep(AGAIN_S)
                continue
            self.pid = process.pid
            _log.info("looking for the landing pad: process %d", process.pid)
            try:
                words = await self._read(process)
            finally:
                self.pid = None
                with contextlib.suppress(ProcessLookupError):
                    process.kill()
            await process.wait()
            _log.error("the process that looks for the landing pad %s; it is started again", words)
            await asyncio.sleep(AGAIN_S)

    async def _read(self, process: asyncio.subprocess.Process) -> str:
        assert process.stdout is not None
        while True:
            try:
                line = await process.stdout.readline()
                if not line:
                    return "has ended"
                self._sightings = [*self._sightings[1 - MAX_SIGHTINGS :], decode_line(line)]
            except (msgspec.DecodeError, ValueError) as error:
                return f"said what cannot be understood ({error})"[:200]
