"""At sign-in the drone proves its identity, and the tower proves that it is the one that enrolled the drone.

The tower sends a challenge, the agent answers with a signed hello, and the tower signs its welcome. Both sign the same
transcript, which contains everything that identifies this sign-in; so a signature is invalid in another sign-in, at
another tower, for another drone, over another TLS channel or with other link keys. No I/O; randomness is passed in.
"""

import hashlib
import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from wire.drone_key import KEY_BYTES
from wire.ids import LinkId

SIGN_IN_PROTOCOL: Final = 2
NONCE_BYTES: Final = 32
MAX_TOWER_NAME_LENGTH: Final = 255
MAX_BINDING_BYTES: Final = 64

_DOMAIN: Final = b"control-tower drone sign-in\0"
_BY_AGENT: Final = b"control-tower agent signs hello\0"
_BY_TOWER: Final = b"control-tower tower signs welcome\0"
_SALT: Final = b"control-tower link keys\0"


class MalformedTranscript(ValueError):
    """A field has an impossible size."""


class SignInPurpose(IntEnum):
    """The purpose of the agent's signature."""

    LINK = 1
    EXCHANGE = 2
    """A link; and this key replaces the bearer credential of the upgrade request."""
    TRIAL = 3
    """To check that the key is valid, without a link."""


@dataclass(frozen=True)
class Transcript:
    """The content of a sign-in. Keys and nonces are 32 bytes each.

    `tower`: its host and port, as the agent knows them. `binding`: of the TLS channel (wire.channel_binding), empty if
    the tower knows none. `resume`: the link to continue. Raises MalformedTranscript.
    """

    purpose: SignInPurpose
    drone_id: int
    tower: str
    drone_key: bytes
    tower_key: bytes
    agent_nonce: bytes
    tower_nonce: bytes
    agent_public_key: bytes
    tower_public_key: bytes
    binding: bytes
    resume: int | None

    def __post_init__(self) -> None:
        if any(len(part) != KEY_BYTES for part in self._fixed):
            raise MalformedTranscript("keys and nonces of a sign-in have 32 bytes")
        if len(self.tower.encode()) > MAX_TOWER_NAME_LENGTH or len(self.binding) > MAX_BINDING_BYTES:
            raise MalformedTranscript("the tower's name or the channel's binding is too long")

    @property
    def _fixed(self) -> tuple[bytes, ...]:
        return (
            self.drone_key,
            self.tower_key,
            self.agent_nonce,
            self.tower_nonce,
            self.agent_public_key,
            self.tower_public_key,
        )

    def encode(self) -> bytes:
        """Unique for each sign-in: fixed sizes, and length prefixes for variable fields."""
        tower = self.tower.encode()
        head = struct.pack("<HBI", SIGN_IN_PROTOCOL, self.purpose, self.drone_id)
        resume = b"\0" if self.resume is None else struct.pack("<BI", 1, self.resume)
        sized = b"".join(struct.pack("<H", len(part)) + part for part in (tower, self.binding))
        return _DOMAIN + head + b"".join(self._fixed) + resume + sized

    def for_agent(self) -> bytes:
        """What the agent signs with the drone's key."""
        return _BY_AGENT + self.encode()

    def for_tower(self, link_id: LinkId) -> bytes:
        """What the tower signs with its key: its agreement to the transcript, and the id of the link."""
        return _BY_TOWER + hashlib.sha256(self.encode()).digest() + link_id.to_bytes(4, "little")

    def salt(self) -> bytes:
        """Salt for the link's keys (wire.key_agreement): it ties them to this sign-in. 32 bytes, not secret."""
        return hashlib.sha256(_SALT + self.encode()).digest()
