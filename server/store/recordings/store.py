"""The folder of recordings: `drone-<id>/<file>.units` while one goes on, `<file>.mp4` when it is ready.

Blocking; call it in a thread. `store` names the folder: a row of the database whose file is elsewhere is left alone.
"""

from __future__ import annotations

import re
import secrets
from collections.abc import Container, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from server.store.file_budget import disk_takes, drone_folders, drones_with_files, folder_of, remove_folders
from wire.ids import DroneId

UNITS: Final = ".units"
MP4: Final = ".mp4"
PART: Final = ".part"
_STORE: Final = "store-id"
_STORE_ID: Final = re.compile(r"[0-9a-f]{16}")


_OURS: Final = re.compile(r"([0-9a-f]{16})(?:\.units|\.mp4|(\.mp4\.part))")


@dataclass(frozen=True)
class Stray:
    """A file of a recording that the database does not know. `kept_at`: written last, seconds since 1970."""

    drone_id: int
    path: Path
    size_bytes: int
    kept_at: float


class RecordingStore:
    """`root`: need not be there yet. `id`: empty until it was opened."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self.id = ""

    def open(self) -> None:
        """Finds out which folder this is, or names it. Raises OSError."""
        self._root.mkdir(mode=0o700, parents=True, exist_ok=True)
        path = self._root / _STORE
        if not path.exists():
            written = path.with_name(_STORE + PART)
            written.write_text(secrets.token_hex(8))  # a full disk leaves no name that cannot be read
            written.replace(path)
        found = path.read_text().strip()
        if not _STORE_ID.fullmatch(found):
            raise OSError(f"{path} does not hold the number of a folder")
        self.id = found

    def path(self, drone_id: int, file: str, ending: str) -> Path:
        """Size of one file, present or not."""
        return folder_of(self._root, DroneId(drone_id)) / f"{file}{ending}"

    def remove(self, drone_id: int, file: str) -> None:
        """All that there is of a recording. Raises OSError."""
        for ending in (UNITS, MP4, MP4 + PART):
            self.path(drone_id, file, ending).unlink(missing_ok=True)

    def has_room(self, coming_bytes: int) -> bool:
        """On the disk. Raises OSError."""
        return disk_takes(self._root, coming_bytes)

    def drone_ids(self) -> frozenset[int]:
        """Drones with files, whether they still are or not."""
        return drones_with_files(self._root)

    def remove_drones(self, drone_ids: Iterable[int]) -> None:
        """All that there is of drones that were deleted."""
        remove_folders(self._root, drone_ids)

    def sweep(self, files: Container[str]) -> list[Stray]:
        """Removes incomplete files. Files without a row (`files`) stay and are reported, oldest first: an older copy of
        the database may be in use, and the right one may follow. Raises OSError."""
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
