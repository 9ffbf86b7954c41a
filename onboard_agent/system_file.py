"""Keeps the MAVLink system id of the drone's autopilot in its state folder.

An agent that starts again waits for its own vehicle, and does not take the first one that it hears on a shared line.
"""

import contextlib
from pathlib import Path

from onboard_agent.link.identity_file import write_private


class SystemFile:
    """`folder`: None keeps nothing."""

    def __init__(self, folder: Path | None) -> None:
        self._path = None if folder is None else folder / "system"

    def read(self) -> int | None:
        """Returns the kept id, 1 to 255; None if there is none that can be read."""
        if self._path is not None:
            with contextlib.suppress(OSError, ValueError):
                found = int(self._path.read_text("ascii")[:8])
                return found if 1 <= found <= 255 else None
        return None

    def keep(self, system_id: int) -> None:
        """Writes the id. May take as long as the disk. A disk that takes nothing costs only this."""
        if self._path is not None:
            with contextlib.suppress(OSError):
                write_private(self._path, f"{system_id}\n")
