"""Restricts the tower's data folder and database to its own user, even if an older version or another umask left them
open to everybody."""

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
    """Creates the file if it is missing and restricts it, with the side files of SQLite. Leaves a file of another user
    as it is; SQLite reports one that cannot be created.

    Never opens a file that is there: closing it would end all locks that this process has on it (POSIX), and the next
    command that ends beside the tower would take itself for the last user and remove the write-ahead log.
    """
    with suppress(OSError):  # FileExistsError is the usual case
        os.close(os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600))
    for ending in _SIDE_FILES:
        _close_to_others(path.with_name(path.name + ending), 0o600)


def make_private_folder(folder: Path) -> None:
    """Restricts the data folder if it is ours, that is, if it contains the tower's key or database. Leaves other
    folders as they are."""
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
