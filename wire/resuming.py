"""The proof that the opener of a new control channel still has the link that it names (docs/wire-protocol.md, 2.1).

Both sides prove it with a key that was derived beside those of the link and opens no datagram, over random values that
each of them made for this one sign-in. So an overheard or stored proof is useless on any other channel, and none is
valid twice. No I/O; randomness is passed in.
"""

import hmac
from hashlib import sha256
from typing import Final

from wire.ids import LinkId

NONCE_BYTES: Final = 32

_BY_AGENT: Final = b"tower resume v1 agent"
_BY_TOWER: Final = b"tower resume v1 tower"


class Challenge:
    """What one side of one sign-in must prove, and verify. `resume_key`: of the link (wire.key_agreement).
    `public_key`: of this sign-in's hello. `nonce`: the tower's NONCE_BYTES random bytes for this sign-in."""

    def __init__(self, resume_key: bytes, *, link_id: LinkId, public_key: bytes, nonce: bytes) -> None:
        self._key = resume_key
        self._said = link_id.to_bytes(4, "little") + sha256(public_key).digest() + sha256(nonce).digest()
        self._spent = False

    def by_agent(self) -> bytes:
        """The agent's proof, 32 bytes."""
        return self._mac(_BY_AGENT)

    def by_tower(self) -> bytes:
        """The tower's, which a proof of the agent is answered with."""
        return self._mac(_BY_TOWER)

    def agent_proves(self, proof: bytes) -> bool:
        """Whether this is the agent's proof. One try only: a second is refused, right or wrong."""
        first, self._spent = not self._spent, True
        return hmac.compare_digest(proof, self.by_agent()) and first

    def tower_proves(self, proof: bytes) -> bool:
        """Whether this is the tower's proof."""
        return hmac.compare_digest(proof, self.by_tower())

    def _mac(self, who: bytes) -> bytes:
        return hmac.new(self._key, who + self._said, sha256).digest()
