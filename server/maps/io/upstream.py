"""Fetches one tile from a tile server: the only place where the tower opens a connection to a stranger for a map.

The address comes from an admin, the numbers in it from a request: nothing else of a request reaches the other side.
Where it may lead is judged (`judged_connection.py`). Redirects are not followed. Blocks.
"""

from __future__ import annotations

import http.client
import time
from dataclasses import dataclass
from typing import Final
from urllib.parse import urlsplit

from server.runtime.judged_connection import AddressRefused, AddressUnknown, JudgedConnection, judged_address

MAX_TILE_BYTES: Final = 2_000_000
WITHIN_S: Final = 15.0
_CHUNK_BYTES: Final = 64 * 1024
_USER_AGENT: Final = "ControlTower/1 (map tile cache)"
_NONE: Final = frozenset({204, 404, 410})
_KINDS: Final = (
    (b"\x89PNG\r\n\x1a\n", 0, "image/png"),
    (b"\xff\xd8\xff", 0, "image/jpeg"),
    (b"WEBP", 8, "image/webp"),
    (b"ftypavif", 4, "image/avif"),
)


class TileUnavailable(Exception):
    """It could not be fetched now. The message is for people, without the address (it may contain a key)."""


class ServerRests(TileUnavailable):
    """It did not answer a moment ago, and is left alone for a while."""

    def __init__(self) -> None:
        super().__init__("the tile server did not answer a moment ago")


@dataclass(frozen=True, slots=True)
class Upstream:
    """`template` has {z}, {x} and {y}. `may_be_private`: an admin named a server of their own network."""

    template: str
    may_be_private: bool = False


def media_type(tile: bytes) -> str | None:
    """Returns what a tile is by its first bytes, whatever its server says; None: no image."""
    return next((kind for magic, at, kind in _KINDS if tile[at : at + len(magic)] == magic), None)


def fetch_tile(upstream: Upstream, zoom: int, x: int, y: int) -> bytes | None:
    """Returns an image; None if the server has no such tile. Raises TileUnavailable."""
    url = upstream.template.replace("{z}", str(zoom)).replace("{x}", str(x)).replace("{y}", str(y))
    parts = urlsplit(url)
    host, is_tls = parts.hostname or "", parts.scheme == "https"
    port = parts.port or (443 if is_tls else 80)
    until = time.monotonic() + WITHIN_S
    try:
        address = judged_address(host, port, may_be_private=upstream.may_be_private)
    except AddressUnknown:
        raise TileUnavailable("the name of the tile server is not known") from None
    except AddressRefused:
        raise TileUnavailable("the tile server is in a private network, which this layer does not allow") from None
    connection = JudgedConnection(host, port, address, is_tls=is_tls)
    try:
        path = parts.path + (f"?{parts.query}" if parts.query else "")
        connection.request("GET", path or "/", headers={"User-Agent": _USER_AGENT, "Accept": "image/*"})
        answer = connection.getresponse()
        if answer.status in _NONE:
            return None
        if answer.status != http.HTTPStatus.OK:
            raise TileUnavailable(f"the tile server answers {answer.status}")
        return _image(answer, until)
    except (OSError, http.client.HTTPException, ValueError) as error:
        raise TileUnavailable(f"the tile server cannot be reached ({type(error).__name__})") from None
    finally:
        connection.close()


def _image(answer: http.client.HTTPResponse, until: float) -> bytes:
    body = bytearray()
    while piece := answer.read1(_CHUNK_BYTES):
        body += piece
        if len(body) > MAX_TILE_BYTES:
            raise TileUnavailable("the tile server sends more than a tile")
        if time.monotonic() > until:
            raise TileUnavailable("the tile server is too slow")
    if media_type(bytes(body[:16])) is None:
        raise TileUnavailable("the tile server sends no image")
    return bytes(body)
