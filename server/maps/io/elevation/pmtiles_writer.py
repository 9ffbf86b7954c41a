"""Writes a PMTiles archive (version 3) of any number of PNG tiles, one after another.

Header and root directory have the first 16 KiB, then come the tiles; leaves and metadata, whose size is known last, end
the file. https://github.com/protomaps/PMTiles/blob/main/spec/v3/spec.md
"""

from __future__ import annotations

import gzip
import json
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import IO, Any, Final

from server.maps.io.pmtiles_file import HEADER_BYTES, Entry, tile_id

DATA_AT: Final = 16_384
"""Readers fetch header and root directory with one request of this size."""
LEAF_ENTRIES: Final = 4_096
_GZIP, _PLAIN, _PNG = 2, 1, 2


@dataclass(frozen=True)
class Bounds:
    """Degrees."""

    west: float
    south: float
    east: float
    north: float


@dataclass
class PmtilesWriter:
    out: IO[bytes]
    _entries: list[Entry] = field(default_factory=list)
    _at: int = 0
    _zooms: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.out.write(bytes(DATA_AT))

    @property
    def tiles(self) -> int:
        return len(self._entries)

    @property
    def size_bytes(self) -> int:
        return DATA_AT + self._at

    def add(self, zoom: int, x: int, y: int, tile: bytes) -> None:
        """Each tile once, in any order."""
        self.out.write(tile)
        self._entries.append(Entry(tile_id(zoom, x, y), 1, len(tile), self._at))
        self._at += len(tile)
        self._zooms.add(zoom)

    def finish(self, bounds: Bounds, metadata: Mapping[str, Any]) -> None:
        """At least one tile must have been added."""
        entries = sorted(self._entries, key=lambda entry: entry.tile_id)
        root, leaves = gzip.compress(_directory(entries), mtime=0), b""
        if len(root) > DATA_AT - HEADER_BYTES:
            root, leaves = _with_leaves(entries)
        said = gzip.compress(json.dumps(metadata).encode(), mtime=0)
        leaves_at = DATA_AT + self._at
        self.out.write(leaves + said)
        edges = (bounds.west, bounds.south, bounds.east, bounds.north)
        middle = ((bounds.west + bounds.east) / 2, (bounds.south + bounds.north) / 2)
        count = len(entries)
        head = struct.pack(
            "<7sB11Q6B4iB2i",
            *(b"PMTiles", 3),
            *(HEADER_BYTES, len(root), leaves_at + len(leaves), len(said), leaves_at, len(leaves)),
            *(DATA_AT, self._at, count, count, count),
            *(0, _GZIP, _PLAIN, _PNG, min(self._zooms), max(self._zooms)),
            *(round(edge * 1e7) for edge in edges),
            min(self._zooms),
            *(round(part * 1e7) for part in middle),
        )
        self.out.seek(0)
        self.out.write(head + root)


def _with_leaves(entries: list[Entry]) -> tuple[bytes, bytes]:
    leaves = bytearray()
    root = []
    for at in range(0, len(entries), LEAF_ENTRIES):
        part = entries[at : at + LEAF_ENTRIES]
        leaf = gzip.compress(_directory(part), mtime=0)
        root.append(Entry(part[0].tile_id, 0, len(leaf), len(leaves)))
        leaves += leaf
    return gzip.compress(_directory(root), mtime=0), bytes(leaves)


def _directory(entries: list[Entry]) -> bytes:
    columns = (
        [len(entries)],
        _steps([entry.tile_id for entry in entries]),
        [entry.run_length for entry in entries],
        [entry.length for entry in entries],
        [entry.offset + 1 for entry in entries],
    )
    return b"".join(_varint(number) for column in columns for number in column)


def _steps(ids: list[int]) -> Iterator[int]:
    before = 0
    for one in ids:
        yield one - before
        before = one


def _varint(number: int) -> bytes:
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*out, number])
