"""The folder of recordings: `drone-<id>/<file>.units` while one runs, `<file>.mp4` when it is ready.

Blocking; call it in a thread. `store` identifies the folder: a database row whose file is elsewhere is left alone.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from server.storage.file_budget import disk_takes, drone_folders, drones_with_files, folder_of, remove_folders
from server.storage.folder_id import open_folder
from wire.ids import DroneId

UNITS: Final = ".units"
MP4: Final = ".mp4"
PART: Final = ".part"

_OURS: Final = re.compile(r"([0-9a-f]{16})(?:\.units|\.mp4|(\.mp4\.part))")


@dataclass(frozen=True)
class Stray:
    """A recording file unknown to the database. `kept_at`: last write, seconds since 1970."""

    drone_id: int
    path: Path
    size_bytes: int
    kept_at: float


class RecordingStore:
    """`root`: need not exist yet. `id`: empty until opened."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self.id = ""

    def open(self) -> None:
        """Reads the folder's id, or assigns one. Raises OSError."""
        self.id = open_folder(self._root)

    def path(self, drone_id: int, file: str, ending: str) -> Path:
        """Returns the path of a file, whether it exists or not."""
        return folder_of(self._root, DroneId(drone_id)) / f"{file}{ending}"

    def remove(self, drone_id: int, file: str) -> None:
        """Removes all files of a recording. Raises OSError."""
        for ending in (UNITS, MP4, MP4 + PART):
            self.path(drone_id, file, ending).unlink(missing_ok=True)

    def has_room(self, coming_bytes: int) -> bool:
        """Whether the disk has room. Raises OSError."""
        return disk_takes(self._root, coming_bytes)

    def drone_ids(self) -> frozenset[int]:
        """Drones with files, including deleted ones."""
        return drones_with_files(self._root)

    def remove_drones(self, drone_ids: Iterable[int]) -> None:
        """Removes all files of deleted drones."""
        remove_folders(self._root, drone_ids)

    def sweep(self, files: Container[str]) -> list[Stray]:
        """Removes partial files. Returns files that belong to no row (`files`), oldest first, and keeps them: an older
        copy of the database may have been restored, and the right one may follow. Raises OSError."""
        strays: list[Stray] = []
        for drone_id, folder in drone_folders(self._root):
            for path in list(folder.iterdir()):
                ours = _OURS.fullmatch(path.name)
                if ours is None:
                    continue
                if ours[2]:
                    path.unlink(missing_ok=True)
                elif ours[1] not in files:
                    file_stat = path.stat()
                    strays.append(Stray(drone_id, path, file_stat.st_size, file_stat.st_mtime))
        return sorted(strays, key=lambda one: one.kept_at)

    def remove_stray(self, stray: Stray) -> None:
        """Raises OSError."""
        stray.path.unlink(missing_ok=True)
