"""Writes small PMTiles files (version 3) byte by byte: one tile of zoom 1, and nothing elsewhere."""

import json
import struct
import zlib
from pathlib import Path
from typing import Final

NORTH_EAST_ID: Final = 4
"""Id of tile 1/1/0, in Hilbert-curve order: east of Greenwich, north of the equator."""
PNG, MVT = 2, 1
NOT_COMPRESSED: Final = 1


def varint(number: int) -> bytes:
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*out, number])


def write_tile_file(file: Path, kind: int, tile: bytes, metadata: object) -> None:
    # Number of entries; then for each: id, run length, length, offset plus one.
    directory = b"".join(varint(number) for number in (1, NORTH_EAST_ID, 1, len(tile), 1))
    said = json.dumps(metadata).encode()
    at = 127
    places = (at, len(directory), at + len(directory), len(said), 0, 0, at + len(directory) + len(said), len(tile))
    head = struct.pack("<7sB8Q3Q", b"PMTiles", 3, *places, 1, 1, 1)
    # Declares the whole north as covered: only a request shows that the western half is missing.
    bounds = (-1_800_000_000, 0, 1_800_000_000, 850_000_000)
    rest = struct.pack("<6B4iB2i", 1, NOT_COMPRESSED, NOT_COMPRESSED, kind, 1, 1, *bounds, 1, 0, 0)
    file.write_bytes(head + rest + directory + said + tile)


def one_colour_png(red: int, green: int, blue: int, side: int = 256) -> bytes:
    def chunk(name: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    rows = (b"\0" + bytes((red, green, blue)) * side) * side
    head = struct.pack(">2I5B", side, side, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def _field(number: int, body: bytes) -> bytes:
    return varint(number << 3 | 2) + varint(len(body)) + body


def _value(number: int, what: int) -> bytes:
    return varint(number << 3) + varint(what)


def all_over_mvt(layer: str, extent: int = 4096) -> bytes:
    """Returns a vector tile with one polygon that covers the whole tile."""
    there, back = 2 * extent, 2 * extent - 1  # zigzag
    move_to, line_to_thrice, close = 9, 26, 15
    steps = (move_to, 0, 0, line_to_thrice, there, 0, 0, there, back, 0, close)
    feature = _value(3, 3) + _field(4, b"".join(varint(step) for step in steps))
    return _layer(layer, feature, b"", extent)


def place_mvt(name: str, across: float, along: float, extent: int = 4096) -> bytes:
    """Returns a vector tile with one named place, at these shares of its edges."""
    steps = (9, 2 * round(across * extent), 2 * round(along * extent))
    feature = _field(2, bytes([0, 0])) + _value(3, 1) + _field(4, b"".join(varint(step) for step in steps))
    tags = _field(3, b"name") + _field(4, _field(1, name.encode()))
    return _layer("places", feature, tags, extent)


def _layer(name: str, feature: bytes, tags: bytes, extent: int) -> bytes:
    return _field(3, _field(1, name.encode()) + _field(2, feature) + tags + _value(5, extent) + _value(15, 2))
