"""The flight logs that the tower stores: in one folder, within a budget that owners share (`file_budget`). The oldest
file of the largest account is removed first.

`drone-<id>/<log>-<began>.bin`, where `began` is in seconds since 1970, 0 if unknown. A file exists complete or not at
all: it is written beside and renamed. Blocking; call it in a thread.
"""

from __future__ import annotations

import re
import threading
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import IO, Final

from server.runtime.settings import Settings
from server.storage.file_budget import (
    NOBODY,
    Account,
    StorageFull,
    disk_takes,
    drone_folders,
    drones_with_files,
    folder_of,
    remove_folders,
    share_bytes,
    to_shrink,
)
from wire.ids import DroneId

_ULOG: Final = b"ULog"
"""PX4's format begins so; ArduPilot's dataflash does not."""
_NAME: Final = re.compile(r"(\d{1,5})-(\d{1,10})\.bin")
_PART: Final = ".part"
_MB: Final = 1_000_000
DISK_FULL: Final = "the tower's disk has no room for it"


@dataclass(frozen=True)
class KeptLog:
    """One file. `kept_at`: seconds since 1970."""

    log_id: int
    began_unix_s: int | None
    size_bytes: int
    kept_at: float
    path: Path

    def ending(self) -> str:
        """The usual ending of such a file's name, by how it begins. Reads it."""
        with self.path.open("rb") as file:
            return "ulg" if file.read(len(_ULOG)) == _ULOG else "bin"


@dataclass(eq=False)
class ArrivingLog:
    """A file that is being received: `arrived_bytes` so far. `accounts`: the account of each drone."""

    drone_id: DroneId
    file: IO[bytes]
    accounts: Mapping[int, Account]
    arrived_bytes: int = 0

    @property
    def path(self) -> Path:
        return Path(self.file.name)

    @property
    def account(self) -> Account:
        return self.accounts.get(self.drone_id, NOBODY)


class FlightLogQuota:
    """`budget_bytes`: of all files together; `largest_bytes`: of one. Space is made for received bytes, never for
    announced ones. Thread-safe."""

    def __init__(self, root: Path, *, budget_bytes: int, largest_bytes: int) -> None:
        self._root = root
        self._budget_bytes = budget_bytes
        self.largest_bytes = min(budget_bytes, largest_bytes)
        self._lock = threading.Lock()
        self._arriving: set[ArrivingLog] = set()
        self._kept_at_most: int | None = None
        """Bytes of the stored files at the last count, plus those of files received since."""

    def of(self, drone_id: DroneId) -> list[KeptLog]:
        """Returns logs by number, highest first, the newest file of each."""
        newest: dict[int, KeptLog] = {}
        for kept in _files_in(self._folder(drone_id)):
            known = newest.get(kept.log_id)
            if known is None or known.kept_at < kept.kept_at:
                newest[kept.log_id] = kept
        return [kept for _, kept in sorted(newest.items(), reverse=True)]

    def begin(
        self,
        drone_id: DroneId,
        transaction_id: int,
        size_bytes: int,
        attempt: int,
        accounts: Mapping[int, Account] = MappingProxyType({}),
    ) -> ArrivingLog:
        """Opens a file of that size. `write` to it, then `keep` it; `discard` it in any case. Raises StorageFull,
        OSError."""
        if size_bytes > self.largest_bytes:
            raise StorageFull(f"the tower accepts files of at most {self.largest_bytes // 1_000_000} MB")
        folder = self._folder(drone_id)
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not disk_takes(folder, size_bytes):
            raise StorageFull(DISK_FULL)
        arriving = ArrivingLog(drone_id, (folder / f"{transaction_id}-{attempt}{_PART}").open("wb"), accounts)
        with self._lock:
            self._arriving.add(arriving)
        return arriving

    def write(self, arriving: ArrivingLog, piece: bytes) -> None:
        """Writes received bytes after making space. Raises StorageFull, OSError."""
        with self._lock:
            arriving.arrived_bytes += len(piece)
            self._make_space(arriving)
        if not disk_takes(self._root, len(piece)):
            raise StorageFull(DISK_FULL)
        arriving.file.write(piece)

    def keep(self, arriving: ArrivingLog, log_id: int, began_unix_s: int | None) -> None:
        """Replaces any other file of this log with the complete one."""
        arriving.file.close()
        folder = self._folder(arriving.drone_id)
        path = folder / f"{log_id}-{began_unix_s or 0}.bin"
        with self._lock:
            arriving.path.replace(path)
            self._arriving.discard(arriving)
            if self._kept_at_most is not None:
                self._kept_at_most += arriving.arrived_bytes
        for other in _files_in(folder):
            if other.log_id == log_id and other.path != path:
                other.path.unlink(missing_ok=True)

    def discard(self, arriving: ArrivingLog) -> None:
        """Harmless after `keep`."""
        with self._lock:
            self._arriving.discard(arriving)
        arriving.file.close()
        arriving.path.unlink(missing_ok=True)

    def drone_ids(self) -> frozenset[int]:
        """Drones with files, including deleted ones."""
        return drones_with_files(self._root)

    def sweep(self, deleted: Iterable[int]) -> None:
        """At start: removes files of deleted drones, and partial files."""
        remove_folders(self._root, deleted)
        for _, folder in drone_folders(self._root):
            for half in folder.glob(f"*{_PART}"):
                half.unlink(missing_ok=True)

    def remove_older(self, before_unix_s: float, at_most: int) -> int:
        """Removes logs that were received before then. Returns how many."""
        count = 0
        for _, folder in drone_folders(self._root):
            for kept in list(_files_in(folder)):
                if count == at_most:
                    return count
                if kept.kept_at < before_unix_s:
                    kept.path.unlink(missing_ok=True)
                    with self._lock:
                        self._kept_at_most = None  # counted again before the next removal
                    count += 1
        return count

    def _folder(self, drone_id: DroneId) -> Path:
        return folder_of(self._root, drone_id)

    def _make_space(self, coming: ArrivingLog) -> None:
        """Raises StorageFull if the sender's account exceeds its share."""
        arriving = sum(one.arrived_bytes for one in self._arriving)
        if self._kept_at_most is not None and self._kept_at_most + arriving <= self._budget_bytes:
            return
        accounts = coming.accounts
        kept: dict[Account, list[KeptLog]] = {}
        for drone_id, folder in drone_folders(self._root):
            kept.setdefault(accounts.get(drone_id, NOBODY), []).extend(_files_in(folder))
        for files in kept.values():
            files.sort(key=lambda one: one.kept_at, reverse=True)
        removable = {account: sum(one.size_bytes for one in files) for account, files in kept.items()}
        used = Counter(removable)
        for one in self._arriving:
            used[accounts.get(one.drone_id, NOBODY)] += one.arrived_bytes
        while used.total() > self._budget_bytes:
            account = to_shrink(used, removable, coming=coming.account, budget_bytes=self._budget_bytes)
            if account is None:
                if used[coming.account] > share_bytes(used, budget_bytes=self._budget_bytes):
                    raise StorageFull("the file quota of this drone's owner is used up")
                break  # other senders exceed their share: their next write is refused
            oldest = kept[account].pop()
            oldest.path.unlink(missing_ok=True)
            used[account] -= oldest.size_bytes
            removable[account] -= oldest.size_bytes
        self._kept_at_most = sum(removable.values())


def new_flight_log_quota(settings: Settings) -> FlightLogQuota:
    """Returns the store in the folder and with the limits of the settings."""
    budget_bytes, largest_bytes = settings.files_budget_mb * _MB, settings.file_largest_mb * _MB
    return FlightLogQuota(settings.files, budget_bytes=budget_bytes, largest_bytes=largest_bytes)


def _files_in(folder: Path) -> Iterable[KeptLog]:
    if not folder.is_dir():
        return
    for path in folder.iterdir():
        found = _NAME.fullmatch(path.name)
        if found is None:
            continue
        try:
            file_stat = path.stat()
        except FileNotFoundError:
            continue  # removed meanwhile
        yield KeptLog(int(found[1]), int(found[2]) or None, file_stat.st_size, file_stat.st_mtime, path)
