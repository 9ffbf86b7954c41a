"""Makes the data folder and the database readable only for the tower's own user, also if an older version or another
umask left them open."""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path
from typing import Final

import structlog

from server.runtime.vault import KEY_FILE

_OTHERS: Final = 0o077
_SIDE_FILES: Final = ("", "-wal", "-shm", "-journal")
_log = structlog.get_logger(__name__)


def make_private_file(path: Path) -> None:
    """The file, created if missing, and SQLite's files beside it. Leaves another user's file as it is; SQLite reports a
    file that cannot be created."""
    with suppress(OSError):
        os.close(os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600))
    for ending in _SIDE_FILES:
        _close_to_others(path.with_name(path.name + ending), 0o600)


def make_private_folder(folder: Path) -> None:
    """The data folder, if it is ours: it has the tower's key or database in it. Another folder is left as it is."""
    if (folder / KEY_FILE).is_file() or any(folder.glob("tower.sqlite3*")):
        _close_to_others(folder, 0o700)


def _close_to_others(path: Path, mode: int) -> None:
    try:
        now = path.stat()
        if now.st_uid == os.geteuid() and stat.S_IMODE(now.st_mode) & _OTHERS:
            path.chmod(mode)
            _log.info("made_private", path=str(path), mode=f"{mode:o}")
    except FileNotFoundError:
        return
    except OSError as error:
        _log.warning("cannot_be_made_private", path=str(path), why=error.strerror or str(error))
