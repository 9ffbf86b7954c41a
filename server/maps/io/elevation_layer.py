"""Elevation from tiles of another server, through the tower's own proxy and store."""

from __future__ import annotations

from dataclasses import dataclass

from server.maps.io.terrain import ElevationAway
from server.maps.io.tile_proxy import TileLayer, TileProxy
from server.maps.io.upstream import TileUnavailable


@dataclass(frozen=True)
class ElevationLayer:
    layer: TileLayer
    proxy: TileProxy

    @property
    def key(self) -> str:
        return self.layer.source

    @property
    def zoom(self) -> int:
        return self.layer.max_zoom

    def tile(self, x: int, y: int) -> bytes | None:
        try:
            return self.proxy.tile(self.layer, self.zoom, x, y)
        except TileUnavailable:
            raise ElevationAway from None
