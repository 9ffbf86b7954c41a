"""Tiles of other servers, through the tower: browsers never contact them. From the store if it has them, else fetched,
a few at a time, each only once however many ask.

With the network cut, what is stored goes on being served, however old. A server that does not answer is left alone for
a while, so that a map of nothing but missing tiles does not hold the workers.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from threading import Lock
from typing import Final

import structlog

from server.maps.io.tile_store import TileName, TileStore
from server.maps.io.upstream import ServerRests, TileUnavailable, Upstream, fetch_tile

FETCHES_AT_A_TIME: Final = 6
MAX_WAITING: Final = 300
"""More are refused: whoever asked has moved the map on."""
FRESH_S: Final = 30 * 86_400.0
MISSING_FRESH_S: Final = 86_400.0
FAILURES_TO_REST: Final = 4
REST_S: Final = 20.0

log = structlog.get_logger(__name__)
Fetch = Callable[[Upstream, int, int, int], bytes | None]


@dataclass(frozen=True, slots=True)
class TileLayer:
    """Raster tiles of another server. `min_zoom` and `max_zoom` are those that it has."""

    upstream: Upstream
    max_zoom: int

    @property
    def source(self) -> str:
        return hashlib.sha256(self.upstream.template.encode()).hexdigest()[:16]

    def has(self, zoom: int, x: int, y: int) -> bool:
        return 0 <= zoom <= self.max_zoom and 0 <= x < 1 << zoom and 0 <= y < 1 << zoom

    def name(self, zoom: int, x: int, y: int) -> TileName:
        return TileName(self.source, zoom, x, y)


class TileProxy:
    """Its methods block; call them from a thread."""

    def __init__(self, store: TileStore, fetch: Fetch = fetch_tile, clock: Callable[[], float] = time.time) -> None:
        self.store = store
        self._fetch = fetch
        self._clock = clock
        self._pool = ThreadPoolExecutor(FETCHES_AT_A_TIME, thread_name_prefix="tiles")
        self._lock = Lock()
        self._running: dict[TileName, Future[bytes | None]] = {}
        self._failures: dict[str, tuple[int, float]] = {}
        self.fetched = 0
        self.failed = 0

    def close(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)

    def stored(self, layer: TileLayer, zoom: int, x: int, y: int) -> tuple[bytes | None, bool] | None:
        """Returns what the store has (None: the server has no such tile) and whether it is fresh; None: nothing."""
        found = self.store.get(layer.name(zoom, x, y))
        if found is None:
            return None
        age_s = self._clock() - found.stored_at
        return found.content or None, age_s < (FRESH_S if found.content else MISSING_FRESH_S)

    def begin(self, layer: TileLayer, zoom: int, x: int, y: int) -> Future[bytes | None]:
        """Fetches and stores it. The future raises TileUnavailable."""
        name = layer.name(zoom, x, y)
        with self._lock:
            running = self._running.get(name)
            if running is not None:
                return running
            # It may have come since the caller looked.
            found = self.stored(layer, zoom, x, y)
            if found is not None and found[1]:
                there: Future[bytes | None] = Future()
                there.set_result(found[0])
                return there
            if self._rests(layer.source):
                raise ServerRests
            if len(self._running) >= MAX_WAITING:
                raise TileUnavailable("too many tiles are being fetched")
            future = self._pool.submit(self._fetched, layer, name)
            self._running[name] = future
        future.add_done_callback(lambda _: self._ended(name))
        return future

    def tile(self, layer: TileLayer, zoom: int, x: int, y: int) -> bytes | None:
        """Returns the tile from the store or the server. Raises TileUnavailable."""
        found = self.stored(layer, zoom, x, y)
        if found is not None and found[1]:
            return found[0]
        try:
            return self.begin(layer, zoom, x, y).result()
        except TileUnavailable:
            if found is None:
                raise
            return found[0]

    def _ended(self, name: TileName) -> None:
        with self._lock:
            self._running.pop(name, None)

    def _rests(self, source: str) -> bool:
        failures, since = self._failures.get(source, (0, 0.0))
        return failures >= FAILURES_TO_REST and self._clock() - since < REST_S

    def _fetched(self, layer: TileLayer, name: TileName) -> bytes | None:
        try:
            content = self._fetch(layer.upstream, name.zoom, name.x, name.y)
        except TileUnavailable:
            with self._lock:
                failures, _ = self._failures.get(name.source, (0, 0.0))
                self._failures[name.source] = failures + 1, self._clock()
                self.failed += 1
            raise
        with self._lock:
            self._failures.pop(name.source, None)
            self.fetched += 1
        try:
            self.store.put(name, content or b"")
        except OSError as error:
            log.warning("a map tile cannot be stored", reason=str(error))
        return content
