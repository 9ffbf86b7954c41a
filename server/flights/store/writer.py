"""The thread that writes flights to the disk. The tower's loop hands it chunks and never waits.

- Every `PAUSE_S` it writes what has come. What is written survives the end of the process; what the kernel has not put
  on the disk is lost with the power (30 s with Linux' defaults). Waiting for the disk here would make the other
  flights wait.
- More than `MAX_WAITING_BYTES` is not kept: chunks are dropped and their frames counted.
- A flight whose file cannot be written has a `problem` and takes nothing more. The others go on.
"""

from __future__ import annotations

import errno
import os
import threading
from collections import deque
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Final

import structlog

from server.flights.core.index import MAX_INDEX_BYTES

PAUSE_S: Final = 0.25
MAX_WAITING_BYTES: Final = 32 * 1024 * 1024
"""A hundred drones at 50 frames a second fill it in more than a minute; a disk that is further behind is no disk."""
PROBE_BYTES: Final = 64 * 1024
STOPPED_WITHIN_S: Final = 10.0
FULL: Final = "the tower's disk is full"
TOO_LARGE: Final = "it has reached the largest size of a flight"
_log = structlog.get_logger(__name__)

Write = Callable[[int, bytes], int]
"""As os.write."""


class FlightFile:
    """A server.flights.core.recorder.FlightSink. The counters grow only, each by one side: the loop takes or refuses,
    the thread writes or fails to."""

    def __init__(
        self, writer: FlightWriter, *, drone_id: int, file: str, tlog: Path, index: Path, largest_bytes: int
    ) -> None:
        self.drone_id, self.file = drone_id, file
        self.tlog, self.index = tlog, index
        self.problem = ""
        self.bytes_taken = self.bytes_written = 0
        self.index_bytes = 0
        self.ended_at: datetime | None = None
        self.words = ""
        self.closed = False
        """The thread is done with it."""
        self._refused = 0
        self.unwritten = 0
        self._writer = writer
        self._largest_bytes = largest_bytes
        self.descriptor = -1

    @property
    def frames_lost(self) -> int:
        """Frames that passed the tower and are not in the file."""
        return self._refused + self.unwritten

    def frames(self, chunk: bytes, count: int) -> None:
        if self.problem or not self._writer.put(self, chunk, is_index=False, count=count):
            self._refused += count
            self._writer.frames_refused += count
            return
        self.bytes_taken += len(chunk)
        if self.bytes_taken >= self._largest_bytes:
            self.problem = TOO_LARGE

    def event(self, line: bytes) -> None:
        if self.index_bytes < MAX_INDEX_BYTES:
            self.index_bytes += len(line) + 1
            self._writer.put(self, line + b"\n", is_index=True)

    def end(self, at: datetime, words: str) -> None:
        self.ended_at, self.words = at, words
        self._writer.end(self)


class FlightWriter:
    """One for a tower. `put` and `end` are for the loop; `failing`: the last attempt to write failed. No flight begins
    until another one, or `probe`, has succeeded: it would have no head."""

    def __init__(self, *, max_waiting_bytes: int = MAX_WAITING_BYTES, write: Write = os.write) -> None:
        self.failing = False
        self.frames_written = 0
        self.frames_refused = 0
        self.frames_unwritten = 0
        self._write = write
        self._max = max_waiting_bytes
        self._taken_bytes = self._done_bytes = 0
        self._jobs: deque[tuple[FlightFile, bytes | None, int, bool]] = deque()
        """The file, what to write (None: it ends), the frames in it, and whether it belongs to the index."""
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._work, name="flights", daemon=True)

    def start(self) -> None:
        self._thread.start()

    @property
    def waiting_bytes(self) -> int:
        """What the disk does not have yet."""
        return self._taken_bytes - self._done_bytes

    def put(self, file: FlightFile, piece: bytes, *, is_index: bool, count: int = 0) -> bool:
        """Whether it is taken. `count`: the frames in it. Returns at once."""
        if self.waiting_bytes + len(piece) > self._max:
            return False
        self._taken_bytes += len(piece)
        self._jobs.append((file, piece, count, is_index))
        return True

    def end(self, file: FlightFile) -> None:
        """After everything that was put."""
        self._jobs.append((file, None, 0, False))

    def probe(self, folder: Path) -> bool:
        """After a failure: whether the disk takes writes again. Blocking; call it in another thread."""
        path = folder / "probe.part"
        try:
            descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o600)
            try:
                self._write_all(descriptor, bytes(PROBE_BYTES), 0)
            finally:
                os.close(descriptor)
                path.unlink(missing_ok=True)
        except OSError:
            return False
        self.failing = False
        return True

    def stop(self) -> bool:
        """Writes the rest. Returns whether all of it is written; if not, the thread hangs on the disk."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(STOPPED_WITHIN_S)
        return not self._thread.is_alive() and not self._jobs

    def _work(self) -> None:
        while not self._stopping.wait(PAUSE_S):
            self._write_waiting()
        self._write_waiting()

    def _write_waiting(self) -> None:
        """Each file once, with all that has come for it."""
        tlogs: dict[FlightFile, tuple[list[bytes], int]] = {}
        indexes: dict[FlightFile, list[bytes]] = {}
        ended: list[FlightFile] = []
        for _ in range(len(self._jobs)):
            file, piece, count, is_index = self._jobs.popleft()
            if piece is None:
                ended.append(file)
            elif is_index:
                indexes.setdefault(file, []).append(piece)
            else:
                pieces, before = tlogs.get(file, ([], 0))
                pieces.append(piece)
                tlogs[file] = pieces, before + count
        for file, lines in indexes.items():
            self._append_index(file, b"".join(lines))
        for file, (pieces, count) in tlogs.items():
            self._append_frames(file, b"".join(pieces), count)
        for file in ended:
            if file.descriptor >= 0:
                os.close(file.descriptor)
                file.descriptor = -1
            file.closed = True

    def _append_frames(self, file: FlightFile, chunk: bytes, count: int) -> None:
        if file.problem and file.problem != TOO_LARGE:
            self._lose(file, chunk, count)
            return
        try:
            if file.descriptor < 0:
                file.descriptor = _open(file.tlog)
            self._write_all(file.descriptor, chunk, file.bytes_written)
        except OSError as error:
            self._fail(file, error)
            self._lose(file, chunk, count)
            return
        file.bytes_written += len(chunk)
        self.frames_written += count
        self._done_bytes += len(chunk)
        self.failing = False

    def _append_index(self, file: FlightFile, lines: bytes) -> None:
        self._done_bytes += len(lines)
        try:
            descriptor = _open(file.index)  # a flight may have no entry for minutes
            try:
                self._write_all(descriptor, lines, os.fstat(descriptor).st_size)
            finally:
                os.close(descriptor)
        except OSError as error:
            self._fail(file, error)

    def _write_all(self, descriptor: int, piece: bytes, before: int) -> None:
        """All of it, or nothing: a half entry would end the file for every reader."""
        rest = memoryview(piece)
        try:
            while rest:
                rest = rest[self._write(descriptor, rest) :]  # type: ignore[arg-type]
        except OSError:
            os.ftruncate(descriptor, before)
            raise

    def _lose(self, file: FlightFile, chunk: bytes, count: int) -> None:
        file.unwritten += count
        self.frames_unwritten += count
        self._done_bytes += len(chunk)

    def _fail(self, file: FlightFile, error: OSError) -> None:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        words = FULL if full else f"the tower's disk: {error.strerror or error}"
        if not self.failing:  # once for all flights that it stops
            _log.error("flights_not_recorded", why=words, drone_id=file.drone_id)
        self.failing = True
        file.problem = file.problem or words


def _open(path: Path) -> int:
    flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC
    try:
        return os.open(path, flags, 0o600)
    except FileNotFoundError:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        return os.open(path, flags, 0o600)
