"""The height of the ground at a place, from the elevation that this tower has: terrarium tiles, read bilinearly.

Where there is no tile there is no height: None, never a guess. A coarser zoom does not stand in for a missing tile, as
it would hide what rises between its points. Blocks: call it from a thread.
"""

from __future__ import annotations

import asyncio
import math
from collections import OrderedDict
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Lock
from typing import Final, Protocol, TypeVar

import structlog

from server.maps.io.map_files import MapFile
from server.maps.io.pmtiles_file import BrokenArchive, PmtilesFile
from server.maps.io.terrarium import UNKNOWN_M, BadTile, HeightTile, decode_terrarium

MAX_TILES: Final = 64
"""Kept decoded; each has 200 kB, or 800 kB at 512 pixels."""
MAX_WAITING: Final = 32
"""Questions that wait for the thread; more are refused, as if they took too long."""
WITHIN_S: Final = 8.0
MAX_LAT_DEG: Final = 85.05

_Answer = TypeVar("_Answer")
log = structlog.get_logger(__name__)


class ElevationSource(Protocol):
    """Where tiles come from. `key` changes whenever their content does."""

    @property
    def key(self) -> str: ...
    @property
    def zoom(self) -> int: ...
    def tile(self, x: int, y: int) -> bytes | None:
        """Returns the tile of `zoom`, or None where there is none. Raises ElevationAway if it cannot be had now."""
        ...


class ElevationAway(Exception):
    """The height is known to others, and not to be had now."""


@dataclass
class ElevationFile:
    """A PMTiles archive of the folder of maps. Its finest zoom counts."""

    key: str
    archive: PmtilesFile

    @property
    def zoom(self) -> int:
        return self.archive.max_zoom

    def tile(self, x: int, y: int) -> bytes | None:
        try:
            return self.archive.tile(self.zoom, x, y)
        except (OSError, BrokenArchive) as error:
            log.warning("an elevation file cannot be read", file=self.key, reason=str(error))
            return None


class Terrain:
    """The first source that has a height at a place decides. Safe from several threads."""

    def __init__(
        self,
        files: Callable[[], Iterable[MapFile]],
        others: Callable[[], Iterable[ElevationSource]] = lambda: (),
    ) -> None:
        """`others`: sources besides the files, asked after them."""
        self._files = files
        self._others = others
        self._open: dict[str, ElevationFile] = {}
        self._tiles: OrderedDict[tuple[str, int, int], HeightTile | None] = OrderedDict()
        self._lock = Lock()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="terrain")
        self._waiting = 0

    async def in_turn(self, work: Callable[[], _Answer]) -> _Answer:
        """Runs what asks for heights in the one thread for it: a slow server of elevation must not hold those that the
        rest of the tower needs. Raises TimeoutError."""
        if self._waiting >= MAX_WAITING:
            raise TimeoutError
        self._waiting += 1
        future = asyncio.get_running_loop().run_in_executor(self._thread, work)
        future.add_done_callback(lambda _: self._done())
        async with asyncio.timeout(WITHIN_S):
            return await future

    def _done(self) -> None:
        self._waiting -= 1

    def close(self) -> None:
        self._thread.shutdown(wait=False, cancel_futures=True)

    def heights(self, places: Iterable[tuple[float, float]]) -> list[float | None]:
        """Returns metres above the sea for places of latitude and longitude, in degrees."""
        with self._lock:
            sources: list[ElevationSource] = [*self._current_files(), *self._others()]
            return [self._height(sources, lat_deg, lon_deg) for lat_deg, lon_deg in places]

    def is_there(self) -> bool:
        """Whether this tower has any elevation."""
        return any(True for _ in self._others()) or any(file.role == "terrain" for file in self._files())

    def _current_files(self) -> list[ElevationFile]:
        found = {f"{file.name}-{file.version}": file for file in self._files() if file.role == "terrain"}
        for key in [key for key in self._open if key not in found]:
            self._open.pop(key).archive.close()
        for key, file in found.items():
            if key not in self._open:
                try:
                    self._open[key] = ElevationFile(key, PmtilesFile(file.path))
                except (OSError, BrokenArchive) as error:
                    log.warning("an elevation file cannot be opened", file=file.name, reason=str(error))
        return [self._open[key] for key in found if key in self._open]

    def _height(self, sources: list[ElevationSource], lat_deg: float, lon_deg: float) -> float | None:
        if not abs(lat_deg) <= MAX_LAT_DEG or not abs(lon_deg) <= 180.0:
            return None
        for source in sources:
            height_m = self._at(source, lat_deg, lon_deg)
            if height_m is not None:
                return height_m
        return None

    def _at(self, source: ElevationSource, lat_deg: float, lon_deg: float) -> float | None:
        tiles = 1 << source.zoom
        across = (lon_deg + 180.0) / 360.0 * tiles
        lat = math.radians(lat_deg)
        along = (0.5 - math.log(math.tan(math.pi / 4 + lat / 2)) / (2 * math.pi)) * tiles
        own = self._tile(source, math.floor(across) % tiles, min(max(math.floor(along), 0), tiles - 1))
        if own is None:
            return None
        # Heights stand at the middles of pixels.
        x, y = across * own.side - 0.5, along * own.side - 0.5
        left, top = math.floor(x), math.floor(y)
        share_x, share_y = x - left, y - top

        def point(column: int, row: int) -> float:
            neighbour = self._tile(source, column // own.side % tiles, row // own.side)
            if neighbour is not None and neighbour.side == own.side:
                return neighbour.at(column % own.side, row % own.side)
            # At the edge of what is known its last row goes on, for half a pixel.
            base_x, base_y = math.floor(across) * own.side, math.floor(along) * own.side
            last = own.side - 1
            return own.at(min(max(column - base_x, 0), last), min(max(row - base_y, 0), last))

        corners = [point(left + right, top + down) for down in (0, 1) for right in (0, 1)]
        if UNKNOWN_M in corners:
            return None
        upper = corners[0] * (1 - share_x) + corners[1] * share_x
        lower = corners[2] * (1 - share_x) + corners[3] * share_x
        return upper * (1 - share_y) + lower * share_y

    def _tile(self, source: ElevationSource, x: int, y: int) -> HeightTile | None:
        key = (source.key, x, y)
        if key in self._tiles:
            self._tiles.move_to_end(key)
            return self._tiles[key]
        try:
            raw = source.tile(x, y) if 0 <= y < 1 << source.zoom else None
        except ElevationAway:
            return None  # and asked for again the next time
        tile: HeightTile | None = None
        if raw is not None:
            try:
                tile = decode_terrarium(raw)
            except BadTile as error:
                log.warning("an elevation tile cannot be read", source=source.key, x=x, y=y, reason=str(error))
        self._tiles[key] = tile
        while len(self._tiles) > MAX_TILES:
            self._tiles.popitem(last=False)
        return tile
