"""Keeps the list of towers in the drone's state folder, so that a restarted agent finds another tower than a dead one.

One address a line. Not part of the identity's file, which an older agent must still be able to read.
"""

import contextlib
from pathlib import Path
from typing import Final

from onboard_agent.link.identity_file import write_private
from wire.tower_list import MAX_ADDRESS_LENGTH, MAX_TOWERS

_MAX_BYTES: Final = MAX_TOWERS * (MAX_ADDRESS_LENGTH + 1)


class TowerFile:
    """`folder`: None keeps nothing."""

    def __init__(self, folder: Path | None) -> None:
        self._path = None if folder is None else folder / "towers"

    def read(self) -> tuple[str, ...]:
        """Returns the kept list; empty if there is none that can be read."""
        if self._path is None:
            return ()
        try:
            with self._path.open("rb") as file:
                return tuple(file.read(_MAX_BYTES).decode().split())
        except (OSError, UnicodeDecodeError):
            return ()

    def keep(self, towers: tuple[str, ...]) -> None:
        """Writes the list. A disk that takes nothing costs only this list."""
        if self._path is not None and towers != self.read():
            with contextlib.suppress(OSError):
                write_private(self._path, "".join(f"{one}\n" for one in towers))
