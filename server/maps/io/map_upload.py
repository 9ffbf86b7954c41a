"""Receives a map file: streamed to disk, of bounded size, checked before it becomes a layer."""

from __future__ import annotations

import asyncio
import os
import shutil
from collections.abc import AsyncIterator
from contextlib import suppress
from pathlib import Path
from typing import IO, Final

from server.maps.core import BadMapFile
from server.maps.io.map_files import ENDING
from server.maps.io.pmtiles_file import BrokenArchive, PmtilesFile
from server.maps.io.tile_source import read_kind

MIN_FREE_BYTES: Final = 512_000_000
PIECE_WITHIN_S: Final = 30.0
_START_BYTES: Final = 8


class MapUpload:
    def __init__(self, folder: Path, name: str, max_bytes: int) -> None:
        self._file = folder / f"{name}{ENDING}"
        self._part = folder / f".{name}.{os.urandom(6).hex()}.part"
        self._stream = StreamedFile(self._part, max_bytes, (b"PMTiles\x03",), "not PMTiles, version 3")

    async def receive(self, length: str, pieces: AsyncIterator[bytes]) -> int:
        """Returns the size in bytes. Raises BadMapFile; then nothing has changed."""
        size = await self._stream.receive(length, pieces)
        try:
            await asyncio.to_thread(self._check)
            await asyncio.to_thread(self._part.replace, self._file)
        except OSError as error:
            raise BadMapFile(f"the file cannot be stored ({error.strerror})") from None
        finally:
            with suppress(OSError):
                self._part.unlink()
        return size

    def _check(self) -> None:
        try:
            read_kind(self._part)
            with PmtilesFile(self._part) as archive:
                archive.tile(archive.min_zoom, 0, 0)  # reads the directories
        except ValueError as error:
            raise BadMapFile(f"the upload {error}") from None
        except BrokenArchive as error:
            raise BadMapFile(f"the file is broken: {error}") from None


class StreamedFile:
    """Receives a file into `part`. `starts`: what it may begin with; `otherwise`: words on one that does not."""

    def __init__(self, part: Path, max_bytes: int, starts: tuple[bytes, ...], otherwise: str) -> None:
        self._part = part
        self._max_bytes = max_bytes
        self._starts = starts
        self._otherwise = otherwise

    async def receive(self, length: str, pieces: AsyncIterator[bytes]) -> int:
        """Returns the size in bytes. Raises BadMapFile; then there is no file."""
        if not (length.isascii() and length.isdigit() and len(length) < 16):
            raise BadMapFile("the file's length is required: send Content-Length")
        expected = int(length)
        if expected > self._max_bytes:
            raise BadMapFile(f"the file is larger than {self._max_bytes // 1_000_000} MB")
        try:
            file = await asyncio.to_thread(self._open, expected)
            try:
                await self._write(file, pieces, expected)
            finally:
                await asyncio.to_thread(file.close)
        except BaseException as error:
            with suppress(OSError):
                self._part.unlink()
            if isinstance(error, OSError):
                raise BadMapFile(f"the file cannot be stored ({error.strerror})") from None
            raise
        return expected

    def _open(self, expected: int) -> IO[bytes]:
        self._part.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if shutil.disk_usage(self._part.parent).free < expected + MIN_FREE_BYTES:
            raise BadMapFile("the disk of the tower has no room for this file")
        return self._part.open("xb")

    async def _write(self, file: IO[bytes], pieces: AsyncIterator[bytes], expected: int) -> None:
        taken = 0
        head = b""
        while True:
            try:
                async with asyncio.timeout(PIECE_WITHIN_S):
                    piece = await anext(pieces, None)
            except TimeoutError:
                raise BadMapFile("the file came too slowly") from None
            if piece is None:
                break
            taken += len(piece)
            if taken > expected:
                raise BadMapFile("the file is longer than was said")
            if len(head) < _START_BYTES:
                head = (head + piece[:_START_BYTES])[:_START_BYTES]
                if not any(head.startswith(start[: len(head)]) for start in self._starts):
                    raise BadMapFile(f"the file is {self._otherwise}")
            await asyncio.to_thread(file.write, piece)
        if taken != expected:
            raise BadMapFile("the file is not whole")
