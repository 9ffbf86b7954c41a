"""The thread that writes the black box and reads pieces of it. The agent's loop hands it jobs and never waits.

- While a flight is recorded it writes every `PAUSE_S` what has come, and has the disk make it last once a second: a
  drone that falls loses its power. Without a flight the thread sleeps.
- More than `MAX_WAITING_BYTES` is not kept: a disk that is so far behind is no disk.
- A disk that cannot be written is a `problem`. The flight ends there; after `TRY_AGAIN_AFTER_S` it goes on in another.
"""

import errno
import logging
import os
import secrets
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from onboard_agent.black_box.flight_files import INDEX, TLOG, FlightFiles, NoFlight, index_line
from wire.black_box import BlackBoxFlight, BlackBoxPiece, BlackBoxWanted, deflated

PAUSE_S: Final = 0.25
SYNC_EVERY_S: Final = 1.0
MARK_EVERY_US: Final = 1_000_000
ROOM_EVERY_BYTES: Final = 8 * 1024 * 1024
MAX_WAITING_BYTES: Final = 2 * 1024 * 1024
TRY_AGAIN_AFTER_S: Final = 30.0
STOPPED_WITHIN_S: Final = 2.0
BEHIND: Final = "the disk does not keep up"
FULL: Final = "the disk is full"
_log = logging.getLogger(__name__)


@dataclass
class _Job:
    """What to do: `begin`, `frames`, `end`."""

    kind: str
    at_us: int
    chunk: bytes = b""


class BlackBoxDisk:
    """A onboard_agent.black_box.tape.FlightSink. Assignments to `problem`, `flights` and `answer` are atomic."""

    def __init__(self, folder: Path, budget_bytes: int) -> None:
        self._files = FlightFiles(folder, budget_bytes)
        self.problem = ""
        """Why nothing is recorded; empty: all is well."""
        self.flights: tuple[BlackBoxFlight, ...] = ()
        self.answer: BlackBoxPiece | None = None
        """To the last request."""
        self.lost_chunks = 0
        self._jobs: deque[_Job] = deque()
        self._taken_bytes = self._done_bytes = 0
        self._wanted: BlackBoxWanted | None = None
        self._unfinished: deque[str] = deque()
        """Flights to complete when there is nothing else to do."""
        self._wake = threading.Event()
        self._pause = threading.Event()
        """Set when the agent stops."""
        self._stopping = False
        self._name = ""
        self._descriptor = -1
        self._size = self._next_mark_us = self._room_at = 0
        self._dirty = False
        self._sync_at = self._retry_at = 0.0
        self._flying = False
        """A flight goes on, whether it can be written or not."""
        self._thread = threading.Thread(target=self._work, name="black box", daemon=True)

    def start(self) -> None:
        """Starts the thread."""
        self._thread.start()

    # For the agent's loop.

    def begin(self, at_us: int) -> None:
        self._jobs.append(_Job("begin", at_us))
        self._wake.set()

    def frames(self, chunk: bytes, last_us: int) -> None:
        if self._taken_bytes - self._done_bytes + len(chunk) > MAX_WAITING_BYTES:
            self.lost_chunks += 1
            self.problem = BEHIND
            return
        self._taken_bytes += len(chunk)
        self._jobs.append(_Job("frames", last_us, chunk))

    def end(self, at_us: int) -> None:
        self._jobs.append(_Job("end", at_us))

    def want(self, wanted: BlackBoxWanted) -> None:
        """Reads a piece, in place of any other."""
        self._wanted = wanted
        self._wake.set()

    def stop(self) -> None:
        """Writes the rest, unless the disk hangs."""
        self._stopping = True
        self._pause.set()
        self._wake.set()
        if self._thread.is_alive():
            self._thread.join(STOPPED_WITHIN_S)

    # The thread.

    def _work(self) -> None:
        self._guarded(self._open)
        while not self._stopping:
            if not self._busy() and time.monotonic() >= self._retry_at:
                self._guarded(self._complete)
            if self._flying or self._jobs or self._unfinished:
                self._pause.wait(PAUSE_S)
            else:
                self._wake.wait()
            self._wake.clear()
            self._step()
        self._step()
        if self._descriptor >= 0:
            self._guarded(lambda: self._finish(time.time_ns() // 1000, "the agent was stopped"))

    def _open(self) -> None:
        self._files.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self.flights = self._files.newest()
        self._unfinished.extend(self._files.unfinished())
        self._files.make_room()
        self.flights = self._files.newest()

    def _busy(self) -> bool:
        return self._flying or bool(self._jobs) or self._wanted is not None or self._stopping

    def _complete(self) -> None:
        """Between flights: what a crash left, and the tables."""
        while self._unfinished and not self._busy():
            if not self._files.complete(self._unfinished[0], self._busy):
                return
            self._unfinished.popleft()
            self.problem = ""
            self.flights = self._files.newest()

    def _step(self) -> None:
        for _ in range(len(self._jobs)):
            job = self._jobs.popleft()
            self._guarded(partial(self._do, job))
            self._done_bytes += len(job.chunk)
        if self._dirty and time.monotonic() >= self._sync_at:
            self._sync_at = time.monotonic() + SYNC_EVERY_S
            self._dirty = False
            self._guarded(lambda: os.fdatasync(self._descriptor))
        wanted, self._wanted = self._wanted, None
        if wanted is not None:
            self.answer = self._piece(wanted)

    def _do(self, job: _Job) -> None:
        if job.kind == "begin":
            self._flying = True
            self._begin(job.at_us)
        elif job.kind == "end":
            self._flying = False
            self._finish(job.at_us)
        elif self._descriptor >= 0:
            self._append(job)
        elif self._flying and time.monotonic() >= self._retry_at:
            self._begin(job.at_us)
            self._append(job)

    def _begin(self, at_us: int) -> None:
        self._files.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not self._files.make_room():
            raise OSError(errno.ENOSPC, FULL)
        self._name = f"{time.strftime('%Y%m%dT%H%M%S', time.gmtime(at_us / 1e6))}-{secrets.token_hex(2)}"
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC
        self._append_index(index_line("flight", at_us))
        self._descriptor = os.open(self._files.path(self._name, TLOG), flags, 0o600)
        self._size = self._next_mark_us = 0
        self._room_at = ROOM_EVERY_BYTES
        self.problem = ""
        self.flights = self._files.newest()

    def _append(self, job: _Job) -> None:
        before = self._size
        rest = memoryview(job.chunk)
        try:
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError:
            os.ftruncate(self._descriptor, before)  # a half entry would end the file for every reader
            raise
        self._size += len(job.chunk)
        self._dirty = True
        first_us = int.from_bytes(job.chunk[:8])
        if first_us >= self._next_mark_us:
            self._next_mark_us = first_us + MARK_EVERY_US
            self._append_index(index_line("at", first_us, at=before))
        if self._size >= self._room_at:
            self._room_at = self._size + ROOM_EVERY_BYTES
            if not self._files.make_room(self._name):
                raise OSError(errno.ENOSPC, FULL)
        if self.problem == BEHIND and not self._jobs:
            self.problem = ""

    def _append_index(self, line: bytes) -> None:
        with self._files.path(self._name, INDEX).open("ab") as file:
            file.write(line)

    def _finish(self, at_us: int, words: str = "") -> None:
        if self._descriptor < 0:
            return
        descriptor, self._descriptor = self._descriptor, -1
        self._dirty = False
        name, self._name = self._name, ""
        with self._files.path(name, INDEX).open("ab") as file:
            file.write(index_line("end", at_us, **({"words": words} if words else {})))
        os.fdatasync(descriptor)
        os.close(descriptor)
        self.flights = self._files.newest()
        self._unfinished.append(name)

    def _piece(self, wanted: BlackBoxWanted) -> BlackBoxPiece:
        try:
            entries, after, last = self._files.piece(wanted.flight, wanted.from_us, wanted.to_us, wanted.at)
        except NoFlight:
            return BlackBoxPiece(request=wanted.request, next=0, last=True, words="the flight is not on the drone")
        except OSError as error:
            words = f"the drone's disk: {error.strerror or error}"[:200]
            return BlackBoxPiece(request=wanted.request, next=wanted.at, last=True, words=words)
        return BlackBoxPiece(request=wanted.request, next=after, last=last, data=deflated(entries))

    def _guarded(self, do: Callable[[], None]) -> None:
        """A disk that fails ends the flight that is written, never the thread."""
        try:
            do()
        except OSError as error:
            full = error.errno in (errno.ENOSPC, errno.EDQUOT)
            words = FULL if full else (error.strerror or str(error))
            if not self.problem:
                _log.error("the black box records nothing: %s", words)
            self.problem = words[:200]
            self._retry_at = time.monotonic() + TRY_AGAIN_AFTER_S
            if self._descriptor >= 0:
                os.close(self._descriptor)
                self._descriptor = -1
            self._dirty = False
