"""Separate environments for third-party programs, in the folder of `--peers`, created when first needed."""

from __future__ import annotations

import asyncio
import shutil
import sys
from pathlib import Path


class CannotInstall(Exception):
    """The program cannot be installed here; carries the reason."""


async def environment_with(folder: Path, name: str, package: str, *, holds: str, room_bytes: int) -> Path:
    """Returns the environment `folder/name` with `package` (as for pip) installed. `holds`: a file in it that exists
    once it is complete. Raises CannotInstall."""
    environment = folder / name
    if (environment / holds).exists():
        return environment
    folder.mkdir(parents=True, exist_ok=True)  # noqa: ASYNC240
    if shutil.disk_usage(folder).free < room_bytes:
        raise CannotInstall(f"less than {room_bytes / 1e9:g} GB free")
    for words in (
        [sys.executable, "-m", "venv", str(environment)],
        [str(environment / "bin" / "pip"), "install", "--quiet", package],
    ):
        process = await asyncio.create_subprocess_exec(
            *words, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT
        )
        said, _ = await process.communicate()
        if process.returncode:
            shutil.rmtree(environment, ignore_errors=True)
            raise CannotInstall(said.decode(errors="replace").strip()[-300:])
    return environment
