"""The controller's process seen from the flight process: starts it, reads its reports, ends it.

Nothing here waits for the child: lines to it are written without blocking, and what it says is stamped when it comes.
"""

import asyncio
import contextlib
import logging
import os
import sys
from pathlib import Path
from typing import Final

import msgspec

from onboard_agent.autonomy.core.lines import (
    MAX_LINE_BYTES,
    Gone,
    Raised,
    Report,
    Seen,
    SetUp,
    decode_from_controller,
    encode_line,
)

_log = logging.getLogger(__name__)

COMMAND: Final = (sys.executable, "-m", "onboard_agent.autonomy")
MAX_REPORTS: Final = 200
"""Between two ticks of the agent. A controller that says more is ended."""
GONE_WITHIN_S: Final = 2.0


class ControllerChild:
    """A ControllerPort. Create it inside a running event loop."""

    def __init__(self, command: tuple[str, ...] = COMMAND) -> None:
        self._command = command
        self._loop = asyncio.get_running_loop()
        self._task: asyncio.Task[None] | None = None
        self._process: asyncio.subprocess.Process | None = None
        self._reports: list[tuple[float, Report]] = []
        self._run = 0
        """Number of the present run: an older one reports nothing any more."""
        self._ending: set[asyncio.Task[None]] = set()

    @property
    def pid(self) -> int | None:
        """Process id of the running child."""
        return None if self._process is None else self._process.pid

    def start(self, set_up: SetUp) -> None:
        """Starts a process for this controller."""
        self.stop()
        self._task = self._loop.create_task(self._live(set_up, self._run))

    def say(self, seen: Seen) -> None:
        """Passes telemetry on. A process that does not read is given no more: its silence ends it."""
        process = self._process
        if process is None or process.stdin is None or process.stdin.transport.get_write_buffer_size() > MAX_LINE_BYTES:
            return
        self._write(process, encode_line(seen))

    def reports(self) -> list[tuple[float, Report]]:
        """Returns what the process has said since the last call."""
        reports, self._reports = self._reports, []
        return reports

    def waited_s(self) -> float:
        """Returns how long it was ready to run and had no processor; 0 where the kernel does not count that."""
        try:
            return int(Path(f"/proc/{self.pid}/schedstat").read_text().split()[1]) / 1e9
        except (OSError, ValueError, IndexError):
            return 0.0

    def stop(self) -> None:
        """Kills the process."""
        self._run += 1
        self._reports = []
        process, self._process = self._process, None
        if process is not None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
        if self._task is not None:
            self._ending.add(self._task)  # it waits for the end of the process
            self._task.add_done_callback(self._ending.discard)
            self._task = None

    async def _live(self, set_up: SetUp, run: int) -> None:
        try:
            process = await asyncio.create_subprocess_exec(
                *self._command,
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                limit=MAX_LINE_BYTES,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
            )
        except OSError as error:
            self._came(Gone(f"cannot be started: {error.strerror or error}"), run)
            return
        if run != self._run:  # stopped meanwhile
            process.kill()
            await process.wait()
            return
        self._process = process
        _log.info("controller %s: process %d", set_up.name, process.pid)
        self._write(process, encode_line(set_up))
        words = await self._read(process, run)
        self._came(Gone(words), run)
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        try:
            async with asyncio.timeout(GONE_WITHIN_S):
                await process.wait()
        except TimeoutError:
            _log.error("the controller's process %d cannot be killed; it is left behind", process.pid)

    async def _read(self, process: asyncio.subprocess.Process, run: int) -> str:
        assert process.stdout is not None
        while True:
            try:
                line = await process.stdout.readline()
                if not line:
                    code = await process.wait()
                    return f"was killed by signal {-code}" if code < 0 else f"ended by itself (code {code})"
                report = decode_from_controller(line)
            except (msgspec.DecodeError, ValueError) as error:
                return f"said what cannot be understood: {error}"[:400]
            if isinstance(report, Raised):
                _log.warning("the controller failed: %s", report.words)
            if len(self._reports) >= MAX_REPORTS:
                return "says more than can be followed"
            self._came(report, run)

    def _came(self, report: Report, run: int) -> None:
        if run == self._run:
            self._reports.append((self._loop.time(), report))

    @staticmethod
    def _write(process: asyncio.subprocess.Process, line: bytes) -> None:
        if process.stdin is not None:
            with contextlib.suppress(OSError, RuntimeError):  # it has just ended, which the reader notices
                process.stdin.write(line)
