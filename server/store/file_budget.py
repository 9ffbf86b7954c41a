"""Disk space for the files of drones: a budget in which each owner has a guaranteed share, and free space to keep.

Knows no kind of file; flight logs and recordings share it.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

from wire.ids import DroneId

MIN_FREE_BYTES: Final = 256 * 1024 * 1024
"""On the disk, which the database needs too."""
_FOLDER: Final = re.compile(r"drone-(\d{1,10})")


class NoRoom(Exception):
    """The file is larger than what is taken, or the disk is full. The message is for people."""


Account = int
"""To whom a file is put down: the user id of the drone's owner (of several the first one), NOBODY without an owner."""
NOBODY: Final[Account] = 0


def share_bytes(used: Mapping[Account, int], *, budget_bytes: int) -> float:
    """What each account may keep whatever the others do: the budget in equal parts among those that have anything."""
    return budget_bytes / max(1, sum(size > 0 for size in used.values()))


def to_shrink(
    used: Mapping[Account, int],
    removable: Mapping[Account, int],
    *,
    coming: Account | None,
    budget_bytes: int,
) -> Account | None:
    """The account whose oldest file must go if `used` exceeds the budget: the one that uses the most, never one within
    its share. None: no account; the new file may stay only if `coming` is within its own share.

    Bytes: `used` in total, the new file included; `removable`: neither new nor being written.
    """
    share = share_bytes(used, budget_bytes=budget_bytes)
    for account in sorted(used, key=lambda one: (-used[one], one != coming)):
        if used[account] <= share:
            return None
        if removable.get(account, 0) > 0:
            return account
        if account == coming:
            return None  # they would make room for themselves with what smaller ones keep
    return None


def disk_takes(folder: Path, coming_bytes: int) -> bool:
    """Whether the disk has room for this much and the required free space. Raises OSError."""
    return shutil.disk_usage(folder).free >= coming_bytes + MIN_FREE_BYTES


def folder_of(root: Path, drone_id: DroneId) -> Path:
    """Where the files of one drone are."""
    return root / f"drone-{drone_id}"


def drone_folders(root: Path) -> Iterable[tuple[int, Path]]:
    """One account per drone, with its id."""
    if not root.is_dir():
        return
    for folder in root.iterdir():
        found = _FOLDER.fullmatch(folder.name)
        if found:
            yield int(found[1]), folder


def drones_with_files(root: Path) -> frozenset[int]:
    """Their numbers, whether there still are such drones or not."""
    return frozenset(drone_id for drone_id, _ in drone_folders(root))


def remove_folders(root: Path, drone_ids: Iterable[int]) -> None:
    """The account of deleted drones, if there are any."""
    for drone_id in drone_ids:
        shutil.rmtree(folder_of(root, DroneId(drone_id)), ignore_errors=True)
