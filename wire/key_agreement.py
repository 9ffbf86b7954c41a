"""Derives the two keys of the data channel, and the key that proves a link, from two public keys.

The exchange travels in the control channel (TLS). Fresh X25519 keys give each link its own keys, which cannot be
recovered later. The signatures over both public keys (wire.sign_in) keep a man in the middle out; the salt is not
secret, and only binds the keys to their sign-in.
"""

from typing import NamedTuple

from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey, X25519PublicKey
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from wire.ids import LinkId


class BadPublicKey(ValueError):
    """The other side's public key is not usable for a shared secret."""


class LinkKeys(NamedTuple):
    """One 32-byte ChaCha20-Poly1305 key for each direction; and 32 bytes that prove possession of the link."""

    agent_to_tower: bytes
    tower_to_agent: bytes
    resume: bytes
    """Does not change with the other keys (wire.rekeying), and decrypts nothing: a party that learns it reads no
    datagram."""


def public_bytes(private_key: X25519PrivateKey) -> bytes:
    """Returns the 32 bytes to send to the other side."""
    return private_key.public_key().public_bytes_raw()


def agree(private_key: X25519PrivateKey, their_public_key: bytes, *, salt: bytes, link_id: LinkId) -> LinkKeys:
    """Both sides call this with their own private key and get the same keys.

    `their_public_key`: 32 bytes. `salt`: of the sign-in's transcript. Raises BadPublicKey for an unusable X25519 public
    key.
    """
    return _derive(private_key, their_public_key, salt, b"tower data v2" + link_id.to_bytes(4, "little"))


def agree_by_credential(
    private_key: X25519PrivateKey, their_public_key: bytes, *, credential_hash: str, link_id: LinkId
) -> LinkKeys:
    """The same for a sign-in of protocol 1. `credential_hash`: the hexadecimal SHA-256 of the credential."""
    salt = bytes.fromhex(credential_hash)
    return _derive(private_key, their_public_key, salt, b"tower data v1" + link_id.to_bytes(4, "little"))


def _derive(private_key: X25519PrivateKey, their_public_key: bytes, salt: bytes, info: bytes) -> LinkKeys:
    try:
        secret = private_key.exchange(X25519PublicKey.from_public_bytes(their_public_key))
    except ValueError as error:
        raise BadPublicKey(str(error)) from None
    okm = HKDF(algorithm=SHA256(), length=96, salt=salt, info=info).derive(secret)
    return LinkKeys(agent_to_tower=okm[:32], tower_to_agent=okm[32:64], resume=okm[64:])
