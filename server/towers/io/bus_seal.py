"""Seals what towers tell each other on the bus. Whoever can write to the bus, and has no key of the towers, is believed
nothing and reads nothing.

The keys are those of TOWER_SECRET_KEYS, which all towers of a database have. Each direction between two processes has a
key of its own (HKDF-SHA256), because a tower's number is random and of one process; packets are numbered and sealed
with ChaCha20-Poly1305. A number that does not grow is refused: repeated, or out of order, which NATS never does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from struct import Struct
from typing import Final

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import ChaCha20Poly1305
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

_HEAD: Final = Struct(">16sQ")
SENDER_BYTES: Final = 16
OVERHEAD_BYTES: Final = _HEAD.size + 16


class NotOfATower(ValueError):
    """Not sealed by a tower for this one, repeated, or out of order."""


class BusSeal:
    """For one connection. `me`: this tower's number, 32 hexadecimal digits. `keys`: newest first; asked for when the
    first packet is sealed or opened. `purpose`: of the connection."""

    def __init__(self, me: str, keys: Callable[[], Sequence[bytes]], purpose: str) -> None:
        self._me = bytes.fromhex(me)
        self._keys = keys
        self._purpose = purpose.encode()
        self._sent = 0
        self._sealing: dict[str, ChaCha20Poly1305] = {}
        self._opening: dict[bytes, tuple[ChaCha20Poly1305, int]] = {}
        """By sender: its key, and the number of its newest packet."""

    def seal(self, packet: bytes, to: str) -> bytes:
        """For the tower of this number, with the newest key."""
        cipher = self._sealing.get(to)
        if cipher is None:
            cipher = self._sealing[to] = self._cipher(self._keys()[0], self._me, bytes.fromhex(to))
        self._sent += 1
        head = _HEAD.pack(self._me, self._sent)
        return head + cipher.encrypt(_nonce(self._sent), packet, head)

    def open(self, sealed: bytes) -> bytes:
        """Raises NotOfATower."""
        if len(sealed) < OVERHEAD_BYTES:
            raise NotOfATower("too short")
        sender, number = _HEAD.unpack_from(sealed)
        head, body = sealed[: _HEAD.size], sealed[_HEAD.size :]
        known = self._opening.get(sender)
        ciphers = [self._cipher(key, sender, self._me) for key in self._keys()] if known is None else [known[0]]
        for cipher in ciphers:
            try:
                packet = cipher.decrypt(_nonce(number), body, head)
            except InvalidTag:
                continue
            if known is not None and number <= known[1]:
                raise NotOfATower("repeated, or out of order")
            self._opening[sender] = cipher, number
            return packet
        raise NotOfATower("not sealed by a tower for this one")

    def forget(self, tower: str) -> None:
        """It has ended."""
        self._sealing.pop(tower, None)
        self._opening.pop(bytes.fromhex(tower), None)

    def _cipher(self, key: bytes, sender: bytes, receiver: bytes) -> ChaCha20Poly1305:
        info = b"control-tower bus " + self._purpose
        return ChaCha20Poly1305(HKDF(algorithm=SHA256(), length=32, salt=sender + receiver, info=info).derive(key))


def _nonce(number: int) -> bytes:
    return bytes(4) + number.to_bytes(8, "big")
