"""Encrypts one message for one browser: RFC 8291 (Web Push) over RFC 8188 (`aes128gcm`), in one record.

The push service between tower and browser reads nothing. Pure functions: whoever calls gives the random values.
"""

from __future__ import annotations

import base64
import binascii
import struct
from dataclasses import dataclass
from typing import Final

from cryptography.hazmat.primitives.asymmetric.ec import (
    ECDH,
    SECP256R1,
    EllipticCurvePrivateKey,
    EllipticCurvePublicKey,
)
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

RECORD_BYTES: Final = 4096
MAX_PLAIN_BYTES: Final = 3993
"""Push services take bodies of at least 4096 bytes (RFC 8030, 7.2): less the header (86), the tag (16), a delimiter."""
PUBLIC_KEY_BYTES: Final = 65
AUTH_BYTES: Final = 16
SALT_BYTES: Final = 16
_LAST_RECORD: Final = b"\x02"


def base64url(data: bytes) -> str:
    """Without padding."""
    return base64.urlsafe_b64encode(data).rstrip(b"=").decode()


def read_base64url(text: str) -> bytes:
    """With or without padding. Raises ValueError."""
    try:
        return base64.b64decode(text.rstrip("=") + "=" * (-len(text.rstrip("=")) % 4), altchars=b"-_", validate=True)
    except binascii.Error:
        raise ValueError("this is not base64url") from None


def public_bytes(key: EllipticCurvePublicKey) -> bytes:
    """65 bytes: the uncompressed point."""
    return key.public_bytes(Encoding.X962, PublicFormat.UncompressedPoint)


@dataclass(frozen=True, slots=True)
class BrowserKeys:
    """What a browser gives with a subscription. `p256dh`: its public key, an uncompressed point of P-256 (65 bytes);
    `auth`: a secret that it shares with the tower (16 bytes)."""

    p256dh: bytes
    auth: bytes

    @classmethod
    def read(cls, p256dh: str, auth: str) -> BrowserKeys:
        """Both base64url. Raises ValueError unless they are a point of the curve and 16 bytes."""
        keys = cls(read_base64url(p256dh), read_base64url(auth))
        if len(keys.p256dh) != PUBLIC_KEY_BYTES or len(keys.auth) != AUTH_BYTES:
            raise ValueError("a key has the wrong length")
        EllipticCurvePublicKey.from_encoded_point(SECP256R1(), keys.p256dh)
        return keys

    @classmethod
    def from_text(cls, text: str) -> BrowserKeys:
        """Of `text`. Raises ValueError."""
        p256dh, _, auth = text.partition(".")
        return cls.read(p256dh, auth)

    @property
    def text(self) -> str:
        return f"{base64url(self.p256dh)}.{base64url(self.auth)}"

    def __repr__(self) -> str:
        return "BrowserKeys(...)"


def encrypt(plain: bytes, keys: BrowserKeys, *, ephemeral: EllipticCurvePrivateKey, salt: bytes) -> bytes:
    """Returns the body of the request. `ephemeral`: a key of P-256 for this message alone; `salt`: 16 random bytes.
    Raises ValueError if `plain` is longer than MAX_PLAIN_BYTES."""
    if len(plain) > MAX_PLAIN_BYTES:
        raise ValueError("the message is too long")
    ours = public_bytes(ephemeral.public_key())
    shared = ephemeral.exchange(ECDH(), EllipticCurvePublicKey.from_encoded_point(SECP256R1(), keys.p256dh))
    material = _derived(shared, salt=keys.auth, info=b"WebPush: info\0" + keys.p256dh + ours, length=32)
    content_key = _derived(material, salt=salt, info=b"Content-Encoding: aes128gcm\0", length=16)
    nonce = _derived(material, salt=salt, info=b"Content-Encoding: nonce\0", length=12)
    header = salt + struct.pack("!IB", RECORD_BYTES, len(ours)) + ours
    return header + AESGCM(content_key).encrypt(nonce, plain + _LAST_RECORD, None)


def _derived(material: bytes, *, salt: bytes, info: bytes, length: int) -> bytes:
    return HKDF(algorithm=SHA256(), length=length, salt=salt, info=info).derive(material)
