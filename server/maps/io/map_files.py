"""The folder of map files: which PMTiles files it has, and what each says about itself.

Whoever puts a file there adds a layer to the map, and whoever removes it takes it away; nothing has to be restarted.

A file that cannot be used is listed with the reason, so that an admin sees why it is not on the map.
"""

from __future__ import annotations

import json
import re
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

from server.maps.io.tile_source import TileKind, read_kind

MapRole = Literal["imagery", "map", "terrain"]
"""`imagery`: pictures from above; `map`: streets, land and names; `terrain`: heights of the ground."""

ENDING: Final = ".pmtiles"
NAME: Final = re.compile(r"[a-z0-9][a-z0-9_-]{0,79}")
"""Of a file, without its ending; it stands in addresses."""
MAX_FILES: Final = 100
MAX_METADATA_BYTES: Final = 1_000_000
"""Compressed or not: a file's own description is a few kilobytes."""
MAX_TEXT: Final = 200
_HEADER_BYTES: Final = 127
_GZIP: Final = 2
_TERRARIUM: Final = "terrarium"


@dataclass(frozen=True)
class MapFile:
    """A file that can be drawn."""

    name: str
    path: Path
    kind: TileKind
    role: MapRole
    title: str
    attribution: str
    tile_size: int
    version: str
    """Changes whenever the file changes."""
    bytes: int


@dataclass(frozen=True)
class UnusableFile:
    name: str
    problem: str
    """Words that follow the file's name."""


Stamp = tuple[int, int]


class MapFolder:
    """Reads a file again only when its size or time has changed. Blocks: call it from a thread."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._known: dict[str, tuple[Stamp, MapFile | UnusableFile]] = {}

    def look(self) -> tuple[list[MapFile], list[UnusableFile]]:
        """Returns what is there now, by name."""
        found: dict[str, tuple[Stamp, MapFile | UnusableFile]] = {}
        try:
            paths = sorted(path for path in self.folder.iterdir() if path.suffix == ENDING and path.name[0] != ".")
        except OSError:
            paths = []
        for path in paths[:MAX_FILES]:
            name = path.name.removesuffix(ENDING)
            try:
                status = path.stat()
            except OSError:
                continue  # removed meanwhile
            stamp = (status.st_mtime_ns, status.st_size)
            known = self._known.get(name)
            found[name] = known if known is not None and known[0] == stamp else (stamp, _read(name, path, stamp))
        self._known = found
        read = [one for _, one in found.values()]
        return [one for one in read if isinstance(one, MapFile)], [one for one in read if isinstance(one, UnusableFile)]

    def find(self, name: str) -> MapFile | None:
        """Returns a file that can be drawn. Names of other files, or with a path in them, are never there."""
        if not NAME.fullmatch(name):
            return None
        return next((one for one in self.look()[0] if one.name == name), None)


def _read(name: str, path: Path, stamp: Stamp) -> MapFile | UnusableFile:
    if not NAME.fullmatch(name):
        return UnusableFile(name, "must have a name of small letters, digits, - and _")
    try:
        kind = read_kind(path)
        said = _metadata(path)
    except ValueError as error:
        return UnusableFile(name, str(error))
    modified_ns, size = stamp
    return MapFile(
        name=name,
        path=path,
        kind=kind,
        role=_role(kind, said),
        title=_text(said.get("name")) or name,
        attribution=_text(said.get("attribution")),
        tile_size=512 if said.get("tile_size") == 512 else 256,
        version=f"{modified_ns:x}-{size:x}",
        bytes=size,
    )


def _role(kind: TileKind, said: dict[str, Any]) -> MapRole:
    if kind == "vector":
        return "map"
    return "terrain" if said.get("encoding") == _TERRARIUM else "imagery"


def _text(said: object) -> str:
    """Returns plain text: tags, which some makers write into an attribution, are left out."""
    text = re.sub(r"<[^>]*>", "", said) if isinstance(said, str) else ""
    return "".join(letter for letter in text if letter.isprintable()).strip()[:MAX_TEXT]


def _metadata(path: Path) -> dict[str, Any]:
    """Raises ValueError if the file's description cannot be read."""
    try:
        with path.open("rb") as file:
            header = file.read(_HEADER_BYTES)
            at, length = struct.unpack_from("<2Q", header, 24)
            if length > MAX_METADATA_BYTES:
                raise ValueError("names a file whose metadata is too large")
            file.seek(at)
            said = file.read(length)
        if header[97] == _GZIP:
            said = _unpacked(said)
        read = json.loads(said or b"{}")
    except (OSError, zlib.error, UnicodeDecodeError, json.JSONDecodeError, struct.error, OverflowError):
        raise ValueError("names a file whose metadata cannot be read") from None
    return read if isinstance(read, dict) else {}


def _unpacked(said: bytes) -> bytes:
    """Bounded: a small file may claim to be a huge one."""
    unpacker = zlib.decompressobj(wbits=zlib.MAX_WBITS | 16)
    out = unpacker.decompress(said, MAX_METADATA_BYTES)
    if unpacker.unconsumed_tail:
        raise ValueError("names a file whose metadata is too large")
    return out
