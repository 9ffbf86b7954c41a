"""The files that the tower keeps of drones: below one folder, within a budget, the oldest removed first.

`drone-<id>/<log>-<began>.bin`, where `began` is in seconds since 1970, 0 where nobody knows. A file is there whole or
not at all: it is written beside and renamed. Blocking; call it in a thread.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Container, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final

from wire.ids import DroneId

LEFT_FREE_BYTES: Final = 256 * 1024 * 1024
"""On the disk, which the database needs too."""
_NAME: Final = re.compile(r"(\d{1,5})-(\d{1,10})\.bin")
_PART: Final = ".part"
_FOLDER: Final = re.compile(r"drone-(\d{1,10})")


class NoRoom(Exception):
    """The file is larger than what is taken, or the disk is full. The message is for people."""


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
        if shutil.disk_usage(folder).free < size_bytes + LEFT_FREE_BYTES:
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

    def sweep(self, drone_ids: Container[int]) -> None:
        """At start: files of drones that are no more, and halves of files."""
        if not self._root.is_dir():
            return
        for folder in self._root.iterdir():
            found = _FOLDER.fullmatch(folder.name)
            if found and int(found[1]) not in drone_ids:
                shutil.rmtree(folder, ignore_errors=True)
            elif found:
                for half in folder.glob(f"*{_PART}"):
                    half.unlink(missing_ok=True)

    def _folder(self, drone_id: DroneId) -> Path:
        return self._root / f"drone-{drone_id}"

    def _make_room(self, size_bytes: int) -> None:
        files: list[KeptLog] = []
        if self._root.is_dir():
            for folder in self._root.iterdir():
                files += _files_in(folder)
        used = sum(kept.size_bytes for kept in files)
        for oldest in sorted(files, key=lambda kept: kept.kept_at):
            if used + size_bytes <= self._budget_bytes:
                return
            oldest.path.unlink(missing_ok=True)
            used -= oldest.size_bytes


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
