"""Sealed datagrams: ChaCha20-Poly1305 around whatever one side has to say to the other.

`Sealer` is one direction's sending half, `Opener` its receiving half. The checks of `Opener` run in the order of
docs/wire-protocol.md, 3.1, and each has a drop reason. Nothing here knows what the content means.
"""

from struct import Struct
from typing import Final, NamedTuple

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import ChaCha20Poly1305

from wire.drops import Dropped, DropReason
from wire.ids import LinkId
from wire.replay import ReplayWindow

VERSION: Final = 1
KEY_PHASE: Final = 0

_HEADER: Final = Struct("<BBIQ")
HEADER_BYTES: Final = _HEADER.size
POLY1305_BYTES: Final = 16
OVERHEAD_BYTES: Final = HEADER_BYTES + POLY1305_BYTES
SMALLEST_DATAGRAM_BYTES: Final = OVERHEAD_BYTES + 1
LARGEST_DATAGRAM_BYTES: Final = 1452
"""1,500 of Ethernet less IPv6 and UDP headers: passes unfragmented on nearly every path."""
LARGEST_CONTENT_BYTES: Final = LARGEST_DATAGRAM_BYTES - OVERHEAD_BYTES

_COUNTER_LIMIT: Final = 1 << 60
"""Far below the end of 64 bits: a nonce is never used twice under one key."""


class Opened(NamedTuple):
    """What an authentic, fresh datagram contained."""

    content: bytes
    newest: bool
    """Whether no later datagram has come before it: only then may its address be followed."""


def read_link_id(datagram: bytes) -> LinkId:
    """The link that a datagram claims to be of. Raises Dropped for a wrong length or version."""
    if len(datagram) < SMALLEST_DATAGRAM_BYTES:
        raise Dropped(DropReason.TOO_SHORT)
    if len(datagram) > LARGEST_DATAGRAM_BYTES:
        raise Dropped(DropReason.TOO_LONG)
    version, key_phase, link_id, _ = _HEADER.unpack_from(datagram)
    if version != VERSION or key_phase != KEY_PHASE:
        raise Dropped(DropReason.BAD_VERSION)
    return LinkId(link_id)


class Sealer:
    """The sending half of one direction of one link. `key`: 32 bytes, used by no other Sealer, ever."""

    __slots__ = ("_cipher", "_counter", "_link_id")

    def __init__(self, key: bytes, link_id: LinkId) -> None:
        self._cipher = ChaCha20Poly1305(key)
        self._link_id = link_id
        self._counter = 0

    def seal(self, content: bytes) -> bytes:
        """One datagram; `content` is 1 to LARGEST_CONTENT_BYTES long. Each call uses up one counter."""
        if not 0 < len(content) <= LARGEST_CONTENT_BYTES:
            raise ValueError(f"content of {len(content)} bytes does not fit into a datagram")
        counter = self._counter
        if counter >= _COUNTER_LIMIT:
            raise RuntimeError("this key has sealed as much as it may")
        self._counter = counter + 1
        header = _HEADER.pack(VERSION, KEY_PHASE, self._link_id, counter)
        return header + self._cipher.encrypt(b"\0\0\0\0" + header[6:], content, header)


class Opener:
    """The receiving half of one direction of one link."""

    __slots__ = ("_cipher", "_link_id", "_window")

    def __init__(self, key: bytes, link_id: LinkId) -> None:
        self._cipher = ChaCha20Poly1305(key)
        self._link_id = link_id
        self._window = ReplayWindow()

    def so_far(self) -> tuple[int, int]:
        """(datagrams that the other side has sent at least, datagrams of them that came)."""
        return self._window.newest + 1, self._window.accepted

    def open(self, datagram: bytes) -> Opened:
        """The content of a datagram of this link. Raises Dropped with the first check that it fails."""
        if read_link_id(datagram) != self._link_id:
            raise Dropped(DropReason.UNKNOWN_LINK)
        header = datagram[:HEADER_BYTES]
        try:
            content = self._cipher.decrypt(b"\0\0\0\0" + header[6:], datagram[HEADER_BYTES:], header)
        except InvalidTag:
            raise Dropped(DropReason.NOT_AUTHENTIC) from None
        counter = int.from_bytes(header[6:], "little")
        newest = counter > self._window.newest
        if not self._window.accept(counter):
            raise Dropped(DropReason.REPLAYED)
        return Opened(content, newest)
