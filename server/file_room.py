"""Room for the files that the tower keeps of drones: a budget, of which the oldest go first, and a part of the disk
that is left free. Knows no kind of file; shared by flight logs and recordings."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Final, Protocol, TypeVar

from wire.ids import DroneId

LEFT_FREE_BYTES: Final = 256 * 1024 * 1024
"""On the disk, which the database needs too."""
_FOLDER: Final = re.compile(r"drone-(\d{1,10})")


class NoRoom(Exception):
    """The file is larger than what is taken, or the disk is full. The message is for people."""


class Kept(Protocol):
    """Something that may be removed. `kept_at`: since when, in seconds since 1970."""

    @property
    def size_bytes(self) -> int: ...

    @property
    def kept_at(self) -> float: ...


_K = TypeVar("_K", bound=Kept)


def to_remove(kept: Iterable[_K], *, coming_bytes: int, budget_bytes: int) -> list[_K]:
    """Which have to go so that `coming_bytes` more fit into the budget: the oldest, or all of them."""
    files = sorted(kept, key=lambda one: one.kept_at)
    used = sum(one.size_bytes for one in files)
    going: list[_K] = []
    for oldest in files:
        if used + coming_bytes <= budget_bytes:
            break
        going.append(oldest)
        used -= oldest.size_bytes
    return going


def disk_takes(folder: Path, coming_bytes: int) -> bool:
    """Whether the disk has room for so much, and what must stay free. Raises OSError."""
    return shutil.disk_usage(folder).free >= coming_bytes + LEFT_FREE_BYTES


def folder_of(root: Path, drone_id: DroneId) -> Path:
    """Where the files of one drone are."""
    return root / f"drone-{drone_id}"


def drone_folders(root: Path) -> Iterable[tuple[int, Path]]:
    """Of each drone there is one for, with its number."""
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
    """Of drones that were deleted, where there are any."""
    for drone_id in drone_ids:
        shutil.rmtree(folder_of(root, DroneId(drone_id)), ignore_errors=True)
