"""The folder of recordings: `drone-<id>/<file>.units` while one goes on, `<file>.mp4` when it is ready.

Blocking; call it in a thread. `store` names the folder: a row of the database whose file is elsewhere is left alone.
"""

from __future__ import annotations

import re
import secrets
from collections.abc import Container
from pathlib import Path
from typing import Final

from server.file_room import disk_takes, drone_folders, folder_of, remove_strangers
from wire.ids import DroneId

UNITS: Final = ".units"
MP4: Final = ".mp4"
PART: Final = ".part"
_STORE: Final = "store-id"
_STORE_ID: Final = re.compile(r"[0-9a-f]{16}")


class RecordingStore:
    """`root`: need not be there yet."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self.id = ""

    def open(self) -> None:
        """Finds out which folder this is, or names it. Raises OSError."""
        self._root.mkdir(mode=0o700, parents=True, exist_ok=True)
        path = self._root / _STORE
        if not path.exists():
            path.write_text(secrets.token_hex(8))
        found = path.read_text().strip()
        if not _STORE_ID.fullmatch(found):
            raise OSError(f"{path} does not hold the number of a folder")
        self.id = found

    def path(self, drone_id: int, file: str, ending: str) -> Path:
        """Of one file, there or not."""
        return folder_of(self._root, DroneId(drone_id)) / f"{file}{ending}"

    def remove(self, drone_id: int, file: str) -> None:
        """All that there is of a recording. Raises OSError."""
        for ending in (UNITS, MP4, MP4 + PART):
            self.path(drone_id, file, ending).unlink(missing_ok=True)

    def has_room(self, coming_bytes: int) -> bool:
        """On the disk. Raises OSError."""
        return disk_takes(self._root, coming_bytes)

    def sweep(self, drone_ids: Container[int], files: Container[str]) -> int:
        """Removes what belongs to no drone and to no row (`files`), and halves of files. How many files went."""
        remove_strangers(self._root, drone_ids)
        gone = 0
        for _, folder in drone_folders(self._root):
            for path in list(folder.iterdir()):
                ours = path.name.endswith((UNITS, MP4, PART))
                if ours and (path.name.endswith(PART) or path.name.split(".")[0] not in files):
                    path.unlink(missing_ok=True)
                    gone += 1
        return gone
