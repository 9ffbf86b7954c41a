"""Space for the files that the tower stores of drones: a budget, of which each owner has a share that no other can
take, and a part of the disk that is left free. Shared by flight logs and recordings, independent of the kind of file.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

from wire.ids import DroneId

MIN_FREE_BYTES: Final = 256 * 1024 * 1024
"""Free space of the disk, which the database needs too."""
_FOLDER: Final = re.compile(r"drone-(\d{1,10})")


class StorageFull(Exception):
    """The file is larger than allowed, or the disk is full. The message is for people."""


Account = int
"""The account that a file counts for: the user id of the drone's owner (of several the first one), NOBODY without
one."""
NOBODY: Final[Account] = 0


def share_bytes(used: Mapping[Account, int], *, budget_bytes: int) -> float:
    """Returns what each account may store in any case: the budget in equal parts among those that have files."""
    return budget_bytes / max(1, sum(size > 0 for size in used.values()))


def to_shrink(
    used: Mapping[Account, int],
    removable: Mapping[Account, int],
    *,
    coming: Account | None,
    budget_bytes: int,
) -> Account | None:
    """Returns the account whose oldest file goes if `used` exceeds the budget: the largest one, and never one within
    its share. None: no file goes; the new one may stay only if `coming` is within its own share.

    In bytes: `used` of all files including the new one; `removable` of those neither new nor being written.
    """
    share = share_bytes(used, budget_bytes=budget_bytes)
    for account in sorted(used, key=lambda one: (-used[one], one != coming)):
        if used[account] <= share:
            return None
        if removable.get(account, 0) > 0:
            return account
        if account == coming:
            return None  # it would make room for itself at the expense of smaller accounts
    return None


def disk_takes(folder: Path, coming_bytes: int) -> bool:
    """Whether the disk has room for so much beside what must stay free. Raises OSError."""
    return shutil.disk_usage(folder).free >= coming_bytes + MIN_FREE_BYTES


def folder_of(root: Path, drone_id: DroneId) -> Path:
    """Returns the folder of one drone's files."""
    return root / f"drone-{drone_id}"


def drone_folders(root: Path) -> Iterable[tuple[int, Path]]:
    """Yields the id and folder of each drone that has one."""
    if not root.is_dir():
        return
    for folder in root.iterdir():
        found = _FOLDER.fullmatch(folder.name)
        if found:
            yield int(found[1]), folder


def drones_with_files(root: Path) -> frozenset[int]:
    """Returns their ids, including deleted drones."""
    return frozenset(drone_id for drone_id, _ in drone_folders(root))


def remove_folders(root: Path, drone_ids: Iterable[int]) -> None:
    """Removes the folders of deleted drones, if any."""
    for drone_id in drone_ids:
        shutil.rmtree(folder_of(root, DroneId(drone_id)), ignore_errors=True)
