"""A locked file that shows that a process is alive: the kernel releases the lock however the process ends.

Each process locks its own file. A stopped process (SIGSTOP) is alive: its lock stays.
"""

from __future__ import annotations

import fcntl
import os
from pathlib import Path


class LifeFile:
    """The file of this process. `lock` creates and locks it; `unlock` removes it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._descriptor: int | None = None

    def lock(self) -> None:
        """Raises OSError."""
        descriptor = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(descriptor)
            raise
        self._descriptor = descriptor

    def unlock(self) -> None:
        """Harmless if it is not locked."""
        if self._descriptor is not None:
            self._path.unlink(missing_ok=True)
            os.close(self._descriptor)
            self._descriptor = None


def has_died(path: Path) -> bool:
    """Whether the process of this life file is certainly dead. False if the file is missing: nothing is known."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(descriptor)
    return True
