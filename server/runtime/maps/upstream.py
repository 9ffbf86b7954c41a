"""Fetches one tile from a tile server: the only place where the tower opens a connection to a stranger for a map.

The address comes from an admin, the numbers in it from a request: nothing else of a request reaches the other side. A
name is resolved once, every address it has is judged, and the connection goes to the one that was judged, so that a
name that answers differently a moment later leads nowhere else. Redirects are not followed. Blocks.
"""

from __future__ import annotations

import http.client
import ipaddress
import socket
import ssl
import time
from dataclasses import dataclass
from typing import Final
from urllib.parse import urlsplit

MAX_TILE_BYTES: Final = 2_000_000
CONNECT_WITHIN_S: Final = 5.0
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
    address = _judged(host, port, may_be_private=upstream.may_be_private)
    connection = _Judged(host, port, address, is_tls=is_tls)
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


def _judged(host: str, port: int, *, may_be_private: bool) -> str:
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        raise TileUnavailable("the name of the tile server is not known") from None
    addresses = [str(one[4][0]) for one in found]
    if not addresses or not all(is_allowed(address, may_be_private=may_be_private) for address in addresses):
        raise TileUnavailable("the tile server is in a private network, which this layer does not allow")
    return addresses[0]


def is_allowed(address: str, *, may_be_private: bool) -> bool:
    """Whether a tile server may have this address. Link-local ones (metadata of clouds) are never allowed."""
    try:
        ip = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return False
    if isinstance(ip, ipaddress.IPv6Address):
        ip = ip.ipv4_mapped or ip.sixtofour or ip
    if ip.is_multicast or ip.is_unspecified or ip.is_link_local:
        return False
    return ip.is_global or (may_be_private and (ip.is_private or ip.is_loopback))


class _Judged(http.client.HTTPConnection):
    """Connects to the given address, and names the host in TLS and in the request."""

    def __init__(self, host: str, port: int, address: str, *, is_tls: bool) -> None:
        super().__init__(host, port, timeout=CONNECT_WITHIN_S)
        self.default_port = 443 if is_tls else 80
        self._address = address
        self._is_tls = is_tls

    def connect(self) -> None:
        sock = socket.create_connection((self._address, self.port), CONNECT_WITHIN_S)
        if self._is_tls:
            try:
                self.sock = ssl.create_default_context().wrap_socket(sock, server_hostname=self.host)
            except BaseException:
                sock.close()
                raise
        else:
            self.sock = sock
