"""MAVProxy in an environment of its own, made when it is first wanted: it pulls 1.1 GB of packages."""

from __future__ import annotations

import asyncio
import shutil
import sys
from pathlib import Path
from typing import Final

ROOM_BYTES: Final = 3_000_000_000


class CannotInstall(Exception):
    """MAVProxy cannot be had here, with the reason."""


async def mavproxy_in(folder: Path) -> Path:
    """Its program below `folder`, installed from the package index if it is not there yet. Raises CannotInstall."""
    program = folder / "mavproxy" / "bin" / "mavproxy.py"
    if program.exists():
        return program
    folder.mkdir(parents=True, exist_ok=True)  # noqa: ASYNC240
    if shutil.disk_usage(folder).free < ROOM_BYTES:
        raise CannotInstall("less than 3 GB free")
    environment = folder / "mavproxy"
    for words in (
        [sys.executable, "-m", "venv", str(environment)],
        [str(environment / "bin" / "pip"), "install", "--quiet", "MAVProxy"],
    ):
        process = await asyncio.create_subprocess_exec(
            *words, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT
        )
        said, _ = await process.communicate()
        if process.returncode:
            shutil.rmtree(environment, ignore_errors=True)
            raise CannotInstall(said.decode(errors="replace").strip()[-300:])
    return program
