"""A drone's identity: an Ed25519 key generated on the drone, which never leaves it. The tower stores the public key."""

import base64
import binascii
import hashlib
import re
from dataclasses import dataclass, field
from typing import Final

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

from wire.ids import DroneId

KEY_BYTES: Final = 32
"""Length of a seed and of a public key."""
SIGNATURE_BYTES: Final = 64
CALLER_HEADER: Final = "x-tower-drone"
"""`<drone id> <public key>`, sent with the upgrade of a control channel: who will sign. It proves nothing, but lets the
agent skip the queue of unknown callers."""

_FORM: Final = re.compile(r"twk_([1-9][0-9]{0,9})_([A-Za-z0-9_-]{43})")
_ENROLMENT: Final = b"control-tower enrolment v1\0"


class MalformedKey(ValueError):
    """The text does not have the form of a key. The message never contains the text itself."""


@dataclass(frozen=True)
class DroneKey:
    """`twk_<drone id>_<43 characters>`: the 32 bytes of an Ed25519 private key in base64url."""

    drone_id: DroneId
    seed: bytes = field(repr=False)

    def __str__(self) -> str:
        return f"twk_{self.drone_id}_{key_text(self.seed)}"

    @property
    def public(self) -> bytes:
        """The 32 bytes that the tower stores."""
        return public_half(Ed25519PrivateKey.from_private_bytes(self.seed))

    def sign(self, message: bytes) -> bytes:
        """Returns a signature of 64 bytes."""
        return Ed25519PrivateKey.from_private_bytes(self.seed).sign(message)


def parse_drone_key(text: str) -> DroneKey:
    """Parses `text` (surrounding white space is ignored). Raises MalformedKey."""
    match = _FORM.fullmatch(text.strip())
    if match is None:
        raise MalformedKey("a drone's key has the form twk_<drone id>_<43 characters>")
    return DroneKey(drone_id=DroneId(int(match[1])), seed=key_bytes(match[2]))


def public_half(private_key: Ed25519PrivateKey) -> bytes:
    """Returns the 32 bytes of the public key."""
    return private_key.public_key().public_bytes_raw()


def key_text(key: bytes) -> str:
    """Encodes 32 bytes as 43 characters of base64url."""
    return base64.urlsafe_b64encode(key).decode().rstrip("=")


def key_bytes(text: str) -> bytes:
    """Decodes the 32 bytes from the text of `key_text`; each key has exactly one text. Raises MalformedKey."""
    try:
        key = base64.b64decode(f"{text}=", altchars=b"-_", validate=True)
    except (binascii.Error, ValueError):
        raise MalformedKey("a key is 43 characters of base64url") from None
    if len(key) != KEY_BYTES or key_text(key) != text:
        raise MalformedKey("a key is 43 characters of base64url")
    return key


def fingerprint(public_key: bytes) -> str:
    """Returns `SHA256:` and 43 characters of base64: the hash of the 32 bytes, for people."""
    return "SHA256:" + base64.b64encode(hashlib.sha256(public_key).digest()).decode().rstrip("=")


def is_signed(public_key: bytes, signature: bytes, message: bytes) -> bool:
    """Returns whether the owner of the private key has signed the message. False for an invalid key or signature."""
    try:
        Ed25519PublicKey.from_public_bytes(public_key).verify(signature, message)
    except (InvalidSignature, ValueError):
        return False
    return True


def enrolment_statement(token: str, public_key: bytes) -> bytes:
    """What an agent signs at its enrolment: that it has the private key, for this token only."""
    return _ENROLMENT + hashlib.sha256(token.encode()).digest() + public_key
