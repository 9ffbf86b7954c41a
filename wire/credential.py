"""The bearer credential of agents of protocol 1. The tower stores only its hash, and issues no new ones.

At the next sign-in of an agent that supports it, a drone key replaces the credential (wire.drone_key).
"""

import hashlib
import re
from dataclasses import dataclass
from typing import Final

from wire.ids import DroneId

_FORM: Final = re.compile(r"twd_([1-9][0-9]{0,9})_([A-Za-z0-9_-]{43})")


class MalformedCredential(ValueError):
    """The text does not have the form of a credential. The message never contains the text itself."""


@dataclass(frozen=True)
class Credential:
    """`twd_<drone id>_<43 characters>`: 256 random bits in base64url, so a plain SHA-256 suffices as hash."""

    drone_id: DroneId
    secret: str

    def __str__(self) -> str:
        return f"twd_{self.drone_id}_{self.secret}"

    def __repr__(self) -> str:
        return f"Credential(drone_id={self.drone_id}, secret=...)"

    def hashed(self) -> str:
        """What the tower stores: SHA-256 of the whole text, 64 hexadecimal digits."""
        return hashlib.sha256(str(self).encode()).hexdigest()


def parse_credential(text: str) -> Credential:
    """Parses `text` (surrounding white space is ignored). Raises MalformedCredential."""
    match = _FORM.fullmatch(text.strip())
    if match is None:
        raise MalformedCredential("a drone credential has the form twd_<drone id>_<43 characters>")
    return Credential(drone_id=DroneId(int(match[1])), secret=match[2])
