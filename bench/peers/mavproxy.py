"""MAVProxy in a separate environment: it pulls 1.1 GB of packages."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from bench.peers.environment import CannotInstall, environment_with

__all__ = ["CannotInstall", "mavproxy_in"]

ROOM_BYTES: Final = 3_000_000_000
PROGRAM: Final = "bin/mavproxy.py"


async def mavproxy_in(folder: Path) -> Path:
    """Returns its program in `folder`, installed from the package index if missing. Raises CannotInstall."""
    made = await environment_with(folder, "mavproxy", "MAVProxy", holds=PROGRAM, room_bytes=ROOM_BYTES)
    return made / PROGRAM
