"""Sealed datagrams: ChaCha20-Poly1305 around the content that one side sends to the other.

`Sealer` is one direction's sending half, `Opener` its receiving half. The checks of `Opener` run in the order of
docs/wire-protocol.md, 3.1, and each has a drop reason. This module does not interpret the content.
"""

from struct import Struct
from typing import Final

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import ChaCha20Poly1305
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDFExpand

from wire.drops import Dropped, DropReason
from wire.ids import LinkId
from wire.replay import ReplayWindow

VERSION: Final = 1
KEY_PHASES: Final = 256
"""The key phase is counted modulo this."""

_HEADER: Final = Struct("<BBIQ")
HEADER_BYTES: Final = _HEADER.size
POLY1305_BYTES: Final = 16
OVERHEAD_BYTES: Final = HEADER_BYTES + POLY1305_BYTES
MIN_DATAGRAM_BYTES: Final = OVERHEAD_BYTES + 1
MAX_DATAGRAM_BYTES: Final = 1452
"""1,500 of Ethernet less IPv6 and UDP headers: passes unfragmented on nearly every path."""
MAX_CONTENT_BYTES: Final = MAX_DATAGRAM_BYTES - OVERHEAD_BYTES

_COUNTER_LIMIT: Final = 1 << 60
"""Far below the end of 64 bits: a nonce is never used twice under one key."""


def read_link_id(datagram: bytes) -> LinkId:
    """Returns the link id that a datagram claims. Raises Dropped for a wrong length or version."""
    if len(datagram) < MIN_DATAGRAM_BYTES:
        raise Dropped(DropReason.TOO_SHORT)
    if len(datagram) > MAX_DATAGRAM_BYTES:
        raise Dropped(DropReason.TOO_LONG)
    version, _, link_id, _ = _HEADER.unpack_from(datagram)
    if version != VERSION:
        raise Dropped(DropReason.BAD_VERSION)
    return LinkId(link_id)


def next_key(key: bytes) -> bytes:
    """Derives the key of the next phase. The derivation cannot be reversed."""
    return HKDFExpand(algorithm=SHA256(), length=32, info=b"tower data v1 next key").derive(key)


class Sealer:
    """The sending half of one direction of one link. `key`: 32 bytes, never used by another Sealer."""

    __slots__ = ("_cipher", "_counter", "_key", "_link_id", "_phase")

    def __init__(self, key: bytes, link_id: LinkId) -> None:
        self._key = key
        self._cipher = ChaCha20Poly1305(key)
        self._link_id = link_id
        self._phase = 0
        self._counter = 0

    @property
    def sealed(self) -> int:
        """The number of datagrams, under all keys."""
        return self._counter

    def next_key(self) -> None:
        """Changes to the key of the next phase and forgets the present one. The counter continues."""
        self._key = next_key(self._key)
        self._cipher = ChaCha20Poly1305(self._key)
        self._phase = (self._phase + 1) % KEY_PHASES

    def seal(self, content: bytes) -> bytes:
        """Seals one datagram; `content` is 1 to MAX_CONTENT_BYTES long. Each call uses up one counter."""
        if not 0 < len(content) <= MAX_CONTENT_BYTES:
            raise ValueError(f"content of {len(content)} bytes does not fit into a datagram")
        counter = self._counter
        if counter >= _COUNTER_LIMIT:
            raise RuntimeError("this key has sealed as much as it may")
        self._counter = counter + 1
        header = _HEADER.pack(VERSION, self._phase, self._link_id, counter)
        return header + self._cipher.encrypt(b"\0\0\0\0" + header[6:], content, header)


class Opener:
    """The receiving half of one direction of one link. Knows the present key, the next, and for a while the
    previous."""

    __slots__ = ("_ciphers", "_key", "_link_id", "_next", "_window", "newest", "phase")

    def __init__(self, key: bytes, link_id: LinkId) -> None:
        self.phase = 0
        """Of the newest key under which a datagram arrived."""
        self._key = key
        self._ciphers = {0: ChaCha20Poly1305(key)}
        """By phase: the present one, and the previous one until it is retired."""
        self._next: tuple[bytes, ChaCha20Poly1305] | None = None
        """Derived when first needed, so that forged datagrams cause only one derivation."""
        self._link_id = link_id
        self._window = ReplayWindow()
        self.newest = False
        """Whether the datagram opened last is the newest so far: only then may its address be followed."""

    def so_far(self) -> tuple[int, int]:
        """(datagrams known to be sent by the other side, datagrams of these that arrived)."""
        return self._window.newest + 1, self._window.accepted

    def retire_last_key(self) -> None:
        """Stops opening datagrams sealed with the previous key."""
        self._ciphers = {self.phase: self._ciphers[self.phase]}

    def open(self, datagram: bytes) -> bytes:
        """Returns the content of a datagram of this link, 1 byte or more. Raises Dropped with the first check that it
        fails."""
        if not MIN_DATAGRAM_BYTES <= len(datagram) <= MAX_DATAGRAM_BYTES:
            read_link_id(datagram)  # raises Dropped with the reason
        header = datagram[:HEADER_BYTES]
        version, phase, link_id, counter = _HEADER.unpack(header)
        if version != VERSION or link_id != self._link_id:
            read_link_id(datagram)
            raise Dropped(DropReason.UNKNOWN_LINK)
        cipher = self._ciphers.get(phase)
        try:
            content = (cipher or self._next_cipher(phase)).decrypt(
                b"\0\0\0\0" + header[6:], datagram[HEADER_BYTES:], header
            )
        except InvalidTag:
            raise Dropped(DropReason.NOT_AUTHENTIC) from None
        window = self._window
        newest = counter > window.newest
        if not window.accept(counter):
            raise Dropped(DropReason.REPLAYED)
        if cipher is None:
            self._enter(phase)
        self.newest = newest
        return content

    def _next_cipher(self, phase: int) -> ChaCha20Poly1305:
        if phase != (self.phase + 1) % KEY_PHASES:
            raise Dropped(DropReason.BAD_KEY_PHASE)
        if self._next is None:
            key = next_key(self._key)
            self._next = (key, ChaCha20Poly1305(key))
        return self._next[1]

    def _enter(self, phase: int) -> None:
        """Switches to the next key, because the other side has."""
        assert self._next is not None
        last = self._ciphers[self.phase]
        self._key, cipher = self._next
        self._next = None
        self._ciphers = {self.phase: last, phase: cipher}
        self.phase = phase
