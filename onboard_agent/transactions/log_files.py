"""Stores the flight log that is being read and sent as a file in the agent's state directory."""

import contextlib
import os
import shutil
from pathlib import Path
from typing import Final

from onboard_agent.transactions.log_frames import CHUNK
from wire.transactions import LogEntry

LEFT_FREE_BYTES: Final = 64 * 1024 * 1024
"""Disk space left free for everything else."""


class LogFiles:
    """A LogStore. `directory` None: there is no storage, and `open` fails."""

    def __init__(self, directory: Path | None) -> None:
        self._directory = directory
        self._path: Path | None = None

    @property
    def path(self) -> Path:
        """Path of the log opened last."""
        assert self._path is not None
        return self._path

    def open(self, log: LogEntry) -> int:
        """Resumes a log of known start time if number, start and size match; other logs are read from the beginning."""
        if self._directory is None:
            raise OSError("the agent was given no directory for it")
        self._directory.mkdir(parents=True, exist_ok=True)
        path = self._directory / f"{log.log_id}-{log.began_unix_s or 0}-{log.size_bytes}.log"
        for other in self._directory.iterdir():
            if other != path or log.began_unix_s is None:
                other.unlink()
        have = path.stat().st_size if path.exists() else 0
        if have > log.size_bytes or (have < log.size_bytes and have % CHUNK):
            whole = min(have, log.size_bytes) // CHUNK * CHUNK
            os.truncate(path, whole)
            have = whole
        free = shutil.disk_usage(self._directory).free
        if free < log.size_bytes - have + LEFT_FREE_BYTES:
            raise OSError(f"the disk beside the autopilot has {free // 1_000_000} MB left")
        self._path = path
        path.touch()
        return have

    def append(self, data: bytes) -> None:
        """Appends to the log opened last."""
        with self.path.open("ab") as file:
            file.write(data)

    def read(self, offset: int, count: int) -> bytes:
        """Returns bytes of the log opened last."""
        with self.path.open("rb") as file:
            file.seek(offset)
            return file.read(count)

    def remove(self) -> None:
        """Removes the file. If that fails, the next log removes it."""
        if self._path is not None:
            with contextlib.suppress(OSError):
                self._path.unlink()
