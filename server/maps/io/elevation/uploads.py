"""GeoTIFFs that admins upload: streamed to disk, then converted in a process of its own while the tower goes on.

One at a time, because a conversion takes a processor for minutes and disk for each pixel. What came of the last one is
kept until the next, or until somebody has read it. The end of the tower ends a conversion, and leaves nothing of it.
"""

from __future__ import annotations

import asyncio
import logging
import os
import subprocess
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from server.maps.core import BadMapFile
from server.maps.io.elevation.converted import Converted
from server.maps.io.elevation.converting import add_elevation
from server.maps.io.elevation.refusals import BadElevationFile
from server.maps.io.map_upload import StreamedFile

_log = logging.getLogger(__name__)

BUSY: Final = "another GeoTIFF is being received or converted: wait for its end, or stop it"
_STARTS: Final = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
"""TIFF and BigTIFF in both byte orders."""


@dataclass(frozen=True, slots=True)
class Conversion:
    """`share`: that is done, 0 to 1. `problem`: words that follow the name; empty while it runs and if it succeeded."""

    name: str
    share: float = 0.0
    problem: str = ""
    is_running: bool = True


class ElevationUploads:
    def __init__(self, folder: Path, max_bytes: int) -> None:
        self._folder = folder
        self._max_bytes = max_bytes
        self._is_taken = False
        self._task: asyncio.Task[None] | None = None
        self._program: subprocess.Popen[bytes] | None = None
        self._is_stopped = False
        self.latest: Conversion | None = None
        """None: there was none, or it was dismissed."""

    async def begin(
        self,
        name: str,
        length: str,
        pieces: AsyncIterator[bytes],
        *,
        title: str,
        attribution: str,
        on_made: Callable[[Converted], Awaitable[None]],
    ) -> None:
        """Receives the file, and begins to convert it. Raises BadMapFile; then nothing has changed."""
        if self._is_taken:
            raise BadMapFile(BUSY)
        self._is_taken = True
        try:
            part = self._folder / f".{name}.{os.urandom(6).hex()}.tif.part"
            await StreamedFile(part, self._max_bytes, _STARTS, "no TIFF file").receive(length, pieces)
        except BaseException:
            self._is_taken = False
            raise
        self._is_stopped = False
        self.latest = Conversion(name)
        self._task = asyncio.create_task(self._convert(part, name, title, attribution, on_made))

    def stop(self) -> bool:
        """Ends the conversion that runs, or forgets the last one. False: there was none."""
        if self._task is None:
            was, self.latest = self.latest, None
            return was is not None
        self._is_stopped = True
        if self._program is not None:
            self._program.kill()
        return True

    async def close(self) -> None:
        """Ends what runs, and waits for it."""
        if self._task is not None:
            self.stop()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _convert(
        self,
        part: Path,
        name: str,
        title: str,
        attribution: str,
        on_made: Callable[[Converted], Awaitable[None]],
    ) -> None:
        loop = asyncio.get_running_loop()

        def report(share: float) -> None:
            loop.call_soon_threadsafe(self._report, share)

        try:
            made = await asyncio.to_thread(
                add_elevation,
                part,
                self._folder,
                name,
                title=title,
                attribution=attribution,
                max_bytes=self._max_bytes,
                report=report,
                started=self._started,
            )
            await on_made(made)
            self._ended("")
        except BadElevationFile as error:
            self._ended("was stopped" if self._is_stopped else str(error))
        except OSError as error:
            self._ended(f"cannot be stored ({error.strerror})")
        except Exception:
            _log.exception("elevation %s: unexpected", name)
            self._ended("could not be converted: see the tower's log")
        finally:
            await asyncio.to_thread(_remove, part)
            self._task = self._program = None
            self._is_taken = False

    def _started(self, program: subprocess.Popen[bytes]) -> None:
        """Called by the thread that converts."""
        self._program = program
        if self._is_stopped:
            program.kill()

    def _report(self, share: float) -> None:
        if self.latest is not None and self.latest.is_running:
            self.latest = replace(self.latest, share=share)

    def _ended(self, problem: str) -> None:
        if self.latest is not None:
            share = self.latest.share if problem else 1.0
            self.latest = replace(self.latest, share=share, problem=problem, is_running=False)


def _remove(part: Path) -> None:
    with suppress(OSError):
        part.unlink()
