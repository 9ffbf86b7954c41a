"""The source of map tiles: parses `TOWER_TILES` for the tower and the console.

Nothing (the console's own coastline), a URL template of raster tiles elsewhere, or a PMTiles file that the tower
serves. The file is checked here, so that a wrong one is reported at start and not by an empty map.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal
from urllib.parse import urlsplit

from server.kernel.refusal import Refusal

PLACES: Final = ("{z}", "{x}", "{y}")
TileKind = Literal["raster", "vector"]

# https://github.com/protomaps/PMTiles/blob/main/spec/v3/spec.md
_HEADER_BYTES: Final = 127
_MAGIC: Final = b"PMTiles"
_VERSION: Final = 3
_TILE_TYPE_AT: Final = 99
_TILE_TYPES: Final[dict[int, TileKind]] = {1: "vector", 2: "raster", 3: "raster", 4: "raster", 5: "raster"}
"""MVT; PNG, JPEG, WebP, AVIF."""


class NoTileFile(Refusal):
    """This tower serves no tiles of its own."""

    def __init__(self) -> None:
        super().__init__("this tower has no file of map tiles")


@dataclass(frozen=True)
class TileAddresses:
    """Raster tiles that the tower fetches from elsewhere."""

    template: str


@dataclass(frozen=True)
class TileFile:
    """A PMTiles file, with an absolute path."""

    path: Path
    kind: TileKind


TileSource = TileAddresses | TileFile


def read_tiles(text: str) -> TileSource:
    """Raises ValueError with the reason."""
    return _addresses(text) if "://" in text else _file(Path(text))


def _addresses(text: str) -> TileAddresses:
    if not text.startswith(("https://", "http://")):
        raise ValueError("must be an https:// address, or the path of a .pmtiles file")
    if not text.isascii() or not text.isprintable() or any(letter in text for letter in " ;,'\"<>\\"):
        raise ValueError("must not contain spaces, quotes, commas or semicolons")
    missing = [place for place in PLACES if text.count(place) != 1]
    if missing:
        raise ValueError(
            f"must contain {', '.join(missing)} once, like https://tiles.example.org/{{z}}/{{x}}/{{y}}.png"
        )
    parts = urlsplit(text)
    try:
        has_host = bool(parts.hostname) and (parts.port is None or parts.port > 0)
    except ValueError:
        has_host = False
    if not has_host or any(place in parts.netloc for place in ("{", "}", "*", "@")):
        raise ValueError("must name one host, without a password and without {s} or * in it")
    if any(letter in text.replace("{z}", "").replace("{x}", "").replace("{y}", "") for letter in "{}"):
        raise ValueError("must not contain other places than {z}, {x} and {y}")
    return TileAddresses(text)


def _file(path: Path) -> TileFile:
    return TileFile(path.absolute(), read_kind(path))


def read_kind(path: Path) -> TileKind:
    """Checks the header of a file. Raises ValueError with words that follow the setting's or the file's name."""
    try:
        with path.open("rb") as file:
            header = file.read(_HEADER_BYTES)
    except FileNotFoundError:
        raise ValueError("names a file that is not there") from None
    except OSError as error:
        raise ValueError(f"names a file that cannot be read: {error.strerror}") from None
    if len(header) < _HEADER_BYTES or not header.startswith(_MAGIC):
        raise ValueError("names a file that is not PMTiles")
    if header[len(_MAGIC)] != _VERSION:
        raise ValueError(f"names a PMTiles file of version {header[len(_MAGIC)]}: only version {_VERSION} is known")
    kind = _TILE_TYPES.get(header[_TILE_TYPE_AT])
    if kind is None:
        raise ValueError("names a PMTiles file whose tiles are neither images nor MVT")
    return kind
