"""A thread that writes one recording. What comes is put into a bounded place and never waits for the disk."""

from __future__ import annotations

import errno
import os
import threading
import time
from pathlib import Path
from typing import IO, Final

from server.live.recordings.unit_file import MAGIC, entry_of

MAX_WAITING_BYTES: Final = 8 * 1024 * 1024
"""Many seconds of video; a disk that is behind by more does not come back in time."""
SYNC_EVERY_S: Final = 5.0
"""What a power cut may cost. Whatever happens to the tower alone costs nothing that was written."""
CLOSED_WITHIN_S: Final = 10.0
TOO_SLOW: Final = "the tower's disk is too slow to record"


class UnitWriter:
    """`problem`: why nothing is written any more, for people; empty while all is well. `taken_bytes`: all that was put,
    `waiting_bytes`: of it, what the disk does not have yet."""

    def __init__(self, path: Path, *, most_waiting_bytes: int = MAX_WAITING_BYTES) -> None:
        """Makes the file. Raises OSError."""
        self.problem = ""
        self.taken_bytes = len(MAGIC)
        self.waiting_bytes = 0
        self._most = most_waiting_bytes
        self._entries: list[tuple[bytes, int]] = []
        self._changed = threading.Condition()
        self._closing = False
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._file: IO[bytes] = path.open("xb")
        self._synced_at = time.monotonic()
        self._thread = threading.Thread(target=self._work, name=f"recording {path.name}", daemon=True)
        self._thread.start()

    def put(self, message: bytes, came_us: int) -> bool:
        """Takes one unit, or says that it cannot. Returns at once."""
        with self._changed:
            if self.problem or self._closing:
                return False
            if self.waiting_bytes + len(message) > self._most:
                self.problem = TOO_SLOW
                return False
            self._entries.append((message, came_us))
            self.waiting_bytes += len(message)
            self.taken_bytes += len(message)
            self._changed.notify()
        return True

    def close(self) -> bool:
        """Waits until what was taken is written. Whether it is; if not, the thread still hangs on the disk. Harmless a
        second time."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(CLOSED_WITHIN_S)
        return not self._thread.is_alive()

    def _work(self) -> None:
        try:
            with self._file:
                self._file.write(MAGIC)
                while entries := self._next():
                    self._file.writelines(entry_of(*entry) for entry in entries)
                    self._file.flush()
                    self._done(sum(len(message) for message, _ in entries))
                    self._sync(at_least_s=SYNC_EVERY_S)
                self._file.flush()
                self._sync(at_least_s=0.0)
        except OSError as error:
            full = error.errno in (errno.ENOSPC, errno.EDQUOT)
            with self._changed:
                self.problem = "the tower's disk is full" if full else f"the tower's disk: {error.strerror or error}"
                self._entries.clear()
                self.waiting_bytes = 0

    def _next(self) -> list[tuple[bytes, int]]:
        """What waits; nothing only when it is closed."""
        with self._changed:
            while not self._entries and not self._closing:
                self._changed.wait()
            entries, self._entries = self._entries, []
            return entries

    def _done(self, written: int) -> None:
        with self._changed:
            self.waiting_bytes -= written

    def _sync(self, *, at_least_s: float) -> None:
        if time.monotonic() - self._synced_at >= at_least_s:
            os.fdatasync(self._file.fileno())
            self._synced_at = time.monotonic()
