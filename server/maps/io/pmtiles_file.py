"""Reads single tiles of a PMTiles archive, version 3. Blocks: call it from a thread.

https://github.com/protomaps/PMTiles/blob/main/spec/v3/spec.md
"""

from __future__ import annotations

import os
import struct
import zlib
from bisect import bisect_right
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Final, Self

HEADER_BYTES: Final = 127
MAX_DIRECTORY_BYTES: Final = 16_000_000
"""Unpacked. Writers keep directories far below a megabyte."""
MAX_TILE_BYTES: Final = 4_000_000
MAX_DEPTH: Final = 4
"""The specification allows a root and leaves, and advises against more than one level of leaves."""
MAX_DIRECTORIES: Final = 32
_GZIP: Final = 2
_PLAIN: Final = (0, 1)


class BrokenArchive(Exception):
    """The file is not what its header says."""


@dataclass(frozen=True, slots=True)
class Entry:
    """`run_length` 0: a leaf directory."""

    tile_id: int
    run_length: int
    length: int
    offset: int


class PmtilesFile:
    """An open archive. Raises OSError and BrokenArchive."""

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0))
        try:
            header = os.pread(self._file, HEADER_BYTES, 0)
            if len(header) < HEADER_BYTES or not header.startswith(b"PMTiles\x03"):
                raise BrokenArchive("not PMTiles, version 3")
            self._root, self._root_bytes = struct.unpack_from("<2Q", header, 8)
            self._leaves, _, self._data = struct.unpack_from("<3Q", header, 40)
            self._packed, self._tile_packed = header[97], header[98]
            self.min_zoom, self.max_zoom = header[100], header[101]
            if self._packed not in (*_PLAIN, _GZIP) or self._tile_packed not in (*_PLAIN, _GZIP):
                raise BrokenArchive("packed in an unknown way")
        except BaseException:
            os.close(self._file)
            raise
        self._directories: OrderedDict[tuple[int, int], list[Entry]] = OrderedDict()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        os.close(self._file)

    def tile(self, zoom: int, x: int, y: int) -> bytes | None:
        """Returns the tile as its maker wrote it, unpacked; None where the archive has none."""
        if not self.min_zoom <= zoom <= self.max_zoom:
            return None
        wanted = tile_id(zoom, x, y)
        at, length = self._root, self._root_bytes
        for _ in range(MAX_DEPTH):
            entry = _entry_of(self._directory(at, length), wanted)
            if entry is None:
                return None
            if entry.run_length > 0:
                return self._tile(entry)
            at, length = self._leaves + entry.offset, entry.length
        raise BrokenArchive("directories within directories")

    def _tile(self, entry: Entry) -> bytes:
        if entry.length > MAX_TILE_BYTES:
            raise BrokenArchive("a tile that is too large")
        raw = self._bytes(self._data + entry.offset, entry.length)
        return _unpacked(raw, MAX_TILE_BYTES) if self._tile_packed == _GZIP else raw

    def _directory(self, at: int, length: int) -> list[Entry]:
        key = (at, length)
        known = self._directories.get(key)
        if known is not None:
            self._directories.move_to_end(key)
            return known
        if length > MAX_DIRECTORY_BYTES:
            raise BrokenArchive("a directory that is too large")
        raw = self._bytes(at, length)
        entries = _entries(_unpacked(raw, MAX_DIRECTORY_BYTES) if self._packed == _GZIP else raw)
        self._directories[key] = entries
        while len(self._directories) > MAX_DIRECTORIES:
            self._directories.popitem(last=False)
        return entries

    def _bytes(self, at: int, length: int) -> bytes:
        try:
            raw = os.pread(self._file, length, at)
        except OverflowError:
            raise BrokenArchive("a part beyond any file") from None
        if len(raw) != length:
            raise BrokenArchive("a part beyond its end")
        return raw


def tile_id(zoom: int, x: int, y: int) -> int:
    """Returns the tile's number: smaller zooms come first, then the position along a Hilbert curve."""
    along = 0
    half = 1 << zoom >> 1
    while half:
        right, below = bool(x & half), bool(y & half)
        along += half * half * ((3 * right) ^ below)
        if not below:
            if right:
                x, y = half - 1 - (x & (half - 1)), half - 1 - (y & (half - 1))
            x, y = y, x
        x, y = x & (half - 1), y & (half - 1)
        half >>= 1
    before: int = (4**zoom - 1) // 3
    return before + along


def _entry_of(entries: list[Entry], wanted: int) -> Entry | None:
    at = bisect_right(entries, wanted, key=lambda entry: entry.tile_id) - 1
    if at < 0:
        return None
    entry = entries[at]
    return entry if entry.run_length == 0 or wanted < entry.tile_id + entry.run_length else None


def _unpacked(raw: bytes, most: int) -> bytes:
    unpacker = zlib.decompressobj(wbits=zlib.MAX_WBITS | 16)
    try:
        out = unpacker.decompress(raw, most)
    except zlib.error:
        raise BrokenArchive("a part that cannot be unpacked") from None
    if unpacker.unconsumed_tail:
        raise BrokenArchive("a part that is too large")
    return out


def _entries(raw: bytes) -> list[Entry]:
    """Columns: ids as differences, run lengths, lengths, offsets (0: directly after the entry before)."""
    reader = _Varints(raw)
    count = reader.next()
    if count > len(raw):
        raise BrokenArchive("a directory shorter than it says")
    ids, number = [], 0
    for _ in range(count):
        number += reader.next()
        ids.append(number)
    runs = [reader.next() for _ in range(count)]
    lengths = [reader.next() for _ in range(count)]
    entries: list[Entry] = []
    for one, run, length in zip(ids, runs, lengths, strict=True):
        said = reader.next()
        if said == 0 and not entries:
            raise BrokenArchive("a first entry without a place")
        offset = entries[-1].offset + entries[-1].length if said == 0 else said - 1
        entries.append(Entry(one, run, length, offset))
    return entries


class _Varints:
    def __init__(self, raw: bytes) -> None:
        self._raw, self._at = raw, 0

    def next(self) -> int:
        value = shift = 0
        while True:
            if self._at >= len(self._raw) or shift > 63:
                raise BrokenArchive("a number that does not end")
            part = self._raw[self._at]
            self._at += 1
            value |= (part & 0x7F) << shift
            if part < 0x80:
                return value
            shift += 7
