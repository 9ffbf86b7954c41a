"""The video process seen from the flight process: starts it on demand, reads its reports, and ends it if it hangs.

Nothing here waits for the child: lines to it are written without blocking. A child that does not read them, is silent
for a while, or writes an invalid line is killed and restarted, with a longer pause each time.
"""

import asyncio
import contextlib
import logging
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final

import msgspec

from onboard_agent.video.core.child_watch import CHECK_EVERY_S, ChildWatch, Verdict, state_of
from onboard_agent.video.core.lines import MAX_LINE_BYTES, BadLine, SetUp, Watched, decode_from_child, encode_line
from onboard_agent.video.core.service import VideoService

_log = logging.getLogger(__name__)

COMMAND: Final = (sys.executable, "-m", "onboard_agent.video")
END_WITHIN_S: Final = 2.0
GONE_WITHIN_S: Final = 2.0
"""Timeout after a kill. A process that hangs in a camera driver exits only when the driver lets it; the shutdown of the
agent does not wait for that."""
STEADY_S: Final = 20.0
FIRST_PAUSE_S: Final = 0.25
MAX_PAUSE_S: Final = 15.0
"""A start costs seconds of CPU time on a small computer."""


class VideoChild:
    """Run it; call `wake` when the service's demand changes. `changed`: called after the service received a report."""

    def __init__(
        self,
        service: VideoService,
        set_up: SetUp,
        changed: Callable[[], None],
        command: tuple[str, ...] = COMMAND,
        *,
        tower: Callable[[], str] = str,
    ) -> None:
        """`tower`: the address of the tower that the ticket is for; empty: that of `set_up`."""
        self._service = service
        self._tower = tower
        self._set_up = set_up
        self._changed = changed
        self._command = command
        self._loop = asyncio.get_running_loop()
        self._wake = asyncio.Event()
        self._process: asyncio.subprocess.Process | None = None
        self._last: asyncio.subprocess.Process | None = None
        self._sent = Watched()
        self._well = ChildWatch(self._loop.time())
        self.starts = 0
        """Number of starts."""

    @property
    def pid(self) -> int | None:
        """Process id of the running child."""
        return None if self._process is None else self._process.pid

    def wake(self) -> None:
        """The service's demand may have changed."""
        self._send_watched()
        self._wake.set()

    async def run(self) -> None:
        """Runs until cancelled; the child has then ended too."""
        pause_s = 0.0
        while True:
            while not self._service.should_run(self._loop.time()):
                self._wake.clear()
                await self._wake.wait()
            if self._last is not None:
                await self._last.wait()  # a process that could not be killed: never run two at once
            begun_at = self._loop.time()
            try:
                words = await self._live()
            except Exception as error:  # whatever the error, flight goes on without video
                _log.exception("the video process cannot be looked after")
                words = f"cannot be looked after: {error!r}"
            if not words:
                self._service.stopped()
                pause_s = 0.0
                continue
            _log.warning("the video process %s", words)
            self._service.ended()
            self._changed()
            if self._loop.time() - begun_at >= STEADY_S:
                pause_s = 0.0
            await asyncio.sleep(pause_s)
            pause_s = min(MAX_PAUSE_S, max(FIRST_PAUSE_S, 2 * pause_s))

    async def _live(self) -> str:
        """Runs one child from start to end. Returns what went wrong; empty: it was no longer wanted."""
        try:
            process = await asyncio.create_subprocess_exec(
                *self._command,
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                limit=MAX_LINE_BYTES,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
            )
        except OSError as error:
            return f"cannot be started: {error.strerror or error}"
        self.starts += 1
        self._process, self._sent = process, Watched()
        self._well = ChildWatch(self._loop.time())
        reading = asyncio.create_task(self._read(process))
        try:
            self._write(encode_line(msgspec.structs.replace(self._set_up, link=self._service.link)))
            self._send_watched()
            return await self._watch(process, reading)
        finally:
            self._process, self._last = None, process
            await _end(process, reading)

    async def _watch(self, process: asyncio.subprocess.Process, reading: "asyncio.Task[str]") -> str:
        while True:
            await asyncio.wait({reading}, timeout=CHECK_EVERY_S)
            now = self._loop.time()
            if reading.done():
                return reading.result()
            if not self._service.should_run(now):
                return ""
            well = self._well
            verdict = well.judge(_states(process.pid) if well.is_silent else "", now)
            if verdict is Verdict.HUNG:
                _kill(process)
                return f"hangs: it has said nothing for {well.silent_s:.1f} s"
            if verdict is Verdict.SILENT:
                self._service.silent()
                self._changed()
            assert process.stdin is not None
            if process.stdin.transport.get_write_buffer_size() > MAX_LINE_BYTES:
                _kill(process)
                return "hangs: it does not read"

    async def _read(self, process: asyncio.subprocess.Process) -> str:
        """Reads reports until the child fails. Returns what went wrong."""
        assert process.stdout is not None
        while True:
            try:
                line = await process.stdout.readline()
                if not line:
                    code = await process.wait()
                    return f"ended by itself (code {code})"
                report = decode_from_child(line)
            except (BadLine, ValueError) as error:
                return f"said what cannot be understood: {error}"
            self._well.heard()
            self._service.reported(report)
            self._changed()

    def _send_watched(self) -> None:
        watched = self._service.watched
        if watched.streams:
            watched = msgspec.structs.replace(watched, tower=self._tower())
        if self._process is not None and self._sent != watched:
            self._sent = watched
            self._write(encode_line(self._sent))

    def _write(self, line: bytes) -> None:
        assert self._process is not None and self._process.stdin is not None
        with contextlib.suppress(OSError, RuntimeError):  # it has just ended, which the reader notices
            self._process.stdin.write(line)


def _states(pid: int) -> str:
    """Returns the thread states for ChildWatch.judge."""
    try:
        return "".join(state_of(file.read_text()) for file in Path(f"/proc/{pid}/task").glob("*/stat"))
    except OSError:
        return ""


async def _end(process: asyncio.subprocess.Process, reading: "asyncio.Task[str]") -> None:
    """Ends the child by closing its standard input; kills it if it does not exit."""
    if process.stdin is not None:
        process.stdin.close()
    if process.returncode is None:
        try:
            async with asyncio.timeout(END_WITHIN_S):
                await process.wait()
        except (TimeoutError, asyncio.CancelledError) as error:
            _kill(process)
            if isinstance(error, asyncio.CancelledError):
                await _gone(process, reading)
                raise
    await _gone(process, reading)


def _kill(process: asyncio.subprocess.Process) -> None:
    with contextlib.suppress(ProcessLookupError):
        process.kill()


async def _gone(process: asyncio.subprocess.Process, reading: "asyncio.Task[str]") -> None:
    reading.cancel()
    await asyncio.gather(reading, return_exceptions=True)
    try:
        async with asyncio.timeout(GONE_WITHIN_S):
            await process.wait()
    except TimeoutError:
        _log.error("the video process %d hangs in the system and cannot be killed; it is left behind", process.pid)
