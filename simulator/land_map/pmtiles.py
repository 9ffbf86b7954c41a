"""Writes a PMTiles archive, version 3: https://github.com/protomaps/PMTiles/blob/main/spec/v3/spec.md

Small archives only: the root directory must hold all entries.
"""

from __future__ import annotations

import gzip
import json
import os
import struct
from collections.abc import Mapping
from enum import IntEnum
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from simulator.land_map.tile_grid import Bounds, Tile

HEADER_BYTES: Final = 127
MAX_ROOT_BYTES: Final = 16_384 - HEADER_BYTES
"""Readers fetch header and root directory with one request of 16 KiB."""
_PLAIN, _GZIP = 1, 2


class TileType(IntEnum):
    MVT = 1
    PNG = 2
    JPEG = 3
    WEBP = 4


def varint(number: int) -> bytes:
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    out.append(number)
    return bytes(out)


def tile_id(tile: Tile) -> int:
    """Returns the number of a tile: all tiles of smaller zooms come before it, then those along a Hilbert curve."""
    x, y = tile.x, tile.y
    along = 0
    half = 1 << tile.zoom >> 1
    while half:
        right, below = bool(x & half), bool(y & half)
        along += half * half * ((3 * right) ^ below)
        if not below:
            if right:
                x, y = half - 1 - (x & (half - 1)), half - 1 - (y & (half - 1))
            x, y = y, x
        x, y = x & (half - 1), y & (half - 1)
        half >>= 1
    before: int = (4**tile.zoom - 1) // 3
    return before + along


def write_pmtiles(
    file: Path, tiles: Mapping[Tile, bytes], kind: TileType, bounds: Bounds, metadata: Mapping[str, Any]
) -> None:
    """Writes beside the file, then renames: a reader sees the old archive or the new one. MVT is compressed here;
    images are compressed already. Raises ValueError if the directory is too large."""
    ordered = sorted((tile_id(tile), tile) for tile in tiles)
    packed = [gzip.compress(tiles[tile], mtime=0) if kind is TileType.MVT else tiles[tile] for _, tile in ordered]
    root = gzip.compress(_directory([number for number, _ in ordered], [len(one) for one in packed]), mtime=0)
    if len(root) > MAX_ROOT_BYTES:
        raise ValueError(f"{len(tiles)} tiles are too many for one directory")
    said = gzip.compress(json.dumps(metadata).encode(), mtime=0)
    zooms = [tile.zoom for tile in tiles]
    said_at = HEADER_BYTES + len(root)
    data_at = said_at + len(said)
    count, data_bytes = len(ordered), sum(len(one) for one in packed)
    edges = (bounds.west_deg, bounds.south_deg, bounds.east_deg, bounds.north_deg)
    middle = ((edges[0] + edges[2]) / 2, (edges[1] + edges[3]) / 2)
    head = struct.pack(
        "<7sB11Q6B4iB2i",
        *(b"PMTiles", 3),
        *(HEADER_BYTES, len(root), said_at, len(said), data_at, 0, data_at, data_bytes, count, count, count),
        *(1, _GZIP, _GZIP if kind is TileType.MVT else _PLAIN, kind, min(zooms), max(zooms)),
        *(round(edge * 1e7) for edge in edges),
        min(max(zooms), 15),
        *(round(part * 1e7) for part in middle),
    )
    written = file.with_name(f".{file.name}.part")
    with written.open("wb") as out:
        out.writelines([head, root, said, *packed])
        out.flush()
        os.fsync(out.fileno())
    written.replace(file)


def _directory(ids: list[int], lengths: list[int]) -> bytes:
    """Ids as differences, run lengths, lengths, and offsets: 0 means directly after the one before."""
    steps = [ids[0], *(later - earlier for earlier, later in pairwise(ids))]
    offsets = [1] + [0] * (len(ids) - 1)
    columns = ([len(ids)], steps, [1] * len(ids), lengths, offsets)
    return b"".join(varint(number) for column in columns for number in column)
