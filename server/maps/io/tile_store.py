"""Tiles on disk: a cache of bounded size, of which the least recently used go first, and tiles kept for areas, which
stay. Safe from several threads; every call blocks.

An empty file says that the server has no such tile.
"""

from __future__ import annotations

import os
import shutil
import time
from collections import OrderedDict
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Final

EVICT_TO: Final = 0.95
"""A full cache makes room for more than one tile at a time."""
BLOCK_BYTES: Final = 512
"""Even an empty file costs a directory entry: it counts as this much."""


@dataclass(frozen=True, slots=True)
class TileName:
    """`source`: of which layer's address; changes with the address."""

    source: str
    zoom: int
    x: int
    y: int

    @property
    def path(self) -> str:
        return f"{self.source}/{self.zoom}/{self.x}-{self.y}"


@dataclass(frozen=True, slots=True)
class StoredTile:
    content: bytes
    stored_at: float
    """Seconds of the epoch."""


class TileStore:
    """`cached` and `kept` are its folders."""

    def __init__(self, cached: Path, kept: Path, max_bytes: int, now: Callable[[], float] = time.time) -> None:
        self._cached, self._kept = cached, kept
        self._max_bytes = max_bytes
        self._now = now
        self._lock = Lock()
        self._sizes: OrderedDict[str, int] | None = None
        self._bytes = 0

    @property
    def cached_bytes(self) -> int:
        """Of the cache, without what is kept."""
        with self._lock:
            self._index()
            return self._bytes

    def get(self, name: TileName) -> StoredTile | None:
        for folder in (self._kept, self._cached):
            try:
                with (folder / name.path).open("rb") as file:
                    content, at = file.read(), os.fstat(file.fileno()).st_mtime
            except OSError:
                continue
            if folder is self._cached:
                with self._lock:
                    index = self._index()
                    if name.path in index:
                        index.move_to_end(name.path)
            return StoredTile(content, at)
        return None

    def put(self, name: TileName, content: bytes) -> None:
        """Raises OSError."""
        self._write(self._cached / name.path, content)
        with self._lock:
            index = self._index()
            self._bytes += _cost(len(content)) - index.pop(name.path, 0)
            index[name.path] = _cost(len(content))
            gone = []
            if self._bytes > self._max_bytes:
                while index and self._bytes > self._max_bytes * EVICT_TO:
                    path, size = index.popitem(last=False)
                    self._bytes -= size
                    gone.append(path)
        for path in gone:
            with suppress(OSError):
                (self._cached / path).unlink()

    def keep(self, name: TileName, content: bytes) -> None:
        """Stores it until `let_go`. Raises OSError."""
        self._write(self._kept / name.path, content)

    def kept_bytes(self, name: TileName) -> int | None:
        """Returns the size of a kept tile; None: it is not kept."""
        try:
            return (self._kept / name.path).stat().st_size
        except OSError:
            return None

    def mean_bytes(self, source: str) -> int | None:
        """Returns what a tile of this layer has on average, of those in the cache; None: there are none."""
        with self._lock:
            sizes = [size for path, size in self._index().items() if path.startswith(f"{source}/")]
        return sum(sizes) // len(sizes) if sizes else None

    def let_go(self, names: Iterable[TileName]) -> None:
        for name in names:
            with suppress(OSError):
                (self._kept / name.path).unlink()

    def forget(self, source: str) -> None:
        """Removes all of a layer that is no more."""
        with self._lock:
            index = self._index()
            for path in [path for path in index if path.startswith(f"{source}/")]:
                self._bytes -= index.pop(path)
        for folder in (self._cached, self._kept):
            shutil.rmtree(folder / source, ignore_errors=True)

    def free_bytes(self) -> int:
        """Raises OSError."""
        self._kept.mkdir(parents=True, exist_ok=True)
        return shutil.disk_usage(self._kept).free

    def _write(self, file: Path, content: bytes) -> None:
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_name(f".{file.name}.{os.urandom(4).hex()}")
        try:
            part.write_bytes(content)
            part.replace(file)
        except BaseException:
            with suppress(OSError):
                part.unlink()
            raise
        now = self._now()
        os.utime(file, (now, now))

    def _index(self) -> OrderedDict[str, int]:
        """What is on disk, oldest first; read once."""
        if self._sizes is None:
            found = []
            for file in self._cached.glob("*/*/*"):
                with suppress(OSError):
                    status = file.stat()
                    found.append((status.st_mtime, str(file.relative_to(self._cached)), _cost(status.st_size)))
            self._sizes = OrderedDict((path, size) for _, path, size in sorted(found))
            self._bytes = sum(self._sizes.values())
        return self._sizes


def _cost(size: int) -> int:
    return max(size, BLOCK_BYTES)
