"""The files that the tower keeps of drones: below one folder, within a budget, the oldest removed first.

`drone-<id>/<log>-<began>.bin`, where `began` is in seconds since 1970, 0 where nobody knows. A file is there whole or
not at all: it is written beside and renamed. Blocking; call it in a thread.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final

from server.file_room import (
    NoRoom,
    disk_takes,
    drone_folders,
    drones_with_files,
    folder_of,
    remove_folders,
    to_remove,
)
from wire.ids import DroneId

_NAME: Final = re.compile(r"(\d{1,5})-(\d{1,10})\.bin")
_PART: Final = ".part"


@dataclass(frozen=True)
class KeptLog:
    """One file. `kept_at`: seconds since 1970."""

    log_id: int
    began_unix_s: int | None
    size_bytes: int
    kept_at: float
    path: Path


class LogShelf:
    """`budget_bytes`: of all files together; `largest_bytes`: of one."""

    def __init__(self, root: Path, *, budget_bytes: int, largest_bytes: int) -> None:
        self._root = root
        self._budget_bytes = budget_bytes
        self.largest_bytes = min(budget_bytes, largest_bytes)

    def of(self, drone_id: DroneId) -> list[KeptLog]:
        """By number, the newest file of each."""
        newest: dict[int, KeptLog] = {}
        for kept in _files_in(self._folder(drone_id)):
            known = newest.get(kept.log_id)
            if known is None or known.kept_at < kept.kept_at:
                newest[kept.log_id] = kept
        return [kept for _, kept in sorted(newest.items(), reverse=True)]

    def begin(self, drone_id: DroneId, transaction_id: int, size_bytes: int, attempt: int) -> IO[bytes]:
        """A file to write to, room made for it. Raises NoRoom, OSError."""
        if size_bytes > self.largest_bytes:
            raise NoRoom(f"the tower takes files of {self.largest_bytes // 1_000_000} MB at the most")
        self._make_room(size_bytes)
        folder = self._folder(drone_id)
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not disk_takes(folder, size_bytes):
            raise NoRoom("the tower's disk has no room for it")
        return (folder / f"{transaction_id}-{attempt}{_PART}").open("wb")

    def keep(self, drone_id: DroneId, written: Path, log_id: int, began_unix_s: int | None) -> None:
        """What was written whole takes the place of any other file of this log."""
        folder = self._folder(drone_id)
        path = folder / f"{log_id}-{began_unix_s or 0}.bin"
        written.replace(path)
        for other in _files_in(folder):
            if other.log_id == log_id and other.path != path:
                other.path.unlink(missing_ok=True)

    def drone_ids(self) -> frozenset[int]:
        """Drones with files, whether they still are or not."""
        return drones_with_files(self._root)

    def sweep(self, deleted: Iterable[int]) -> None:
        """At start: files of drones that were deleted, and halves of files."""
        remove_folders(self._root, deleted)
        for _, folder in drone_folders(self._root):
            for half in folder.glob(f"*{_PART}"):
                half.unlink(missing_ok=True)

    def _folder(self, drone_id: DroneId) -> Path:
        return folder_of(self._root, drone_id)

    def _make_room(self, size_bytes: int) -> None:
        files = [kept for _, folder in drone_folders(self._root) for kept in _files_in(folder)]
        for oldest in to_remove(files, coming_bytes=size_bytes, budget_bytes=self._budget_bytes):
            oldest.path.unlink(missing_ok=True)


def _files_in(folder: Path) -> Iterable[KeptLog]:
    if not folder.is_dir():
        return
    for path in folder.iterdir():
        found = _NAME.fullmatch(path.name)
        if found is None:
            continue
        try:
            told = path.stat()
        except FileNotFoundError:
            continue  # removed meanwhile
        yield KeptLog(int(found[1]), int(found[2]) or None, told.st_size, told.st_mtime, path)
