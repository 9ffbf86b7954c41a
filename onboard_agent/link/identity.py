"""By what the tower knows the agent: the drone's key, or a bearer credential of old until a key has taken its place.

Every change is kept before it counts. So whatever is lost on the way (an answer, the agent, the tower), what is kept
signs in: first the key, and where the tower does not know that, the credential.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from wire.credential import Credential, MalformedCredential, parse_credential
from wire.drone_key import KEY_BYTES, DroneKey, MalformedKey, key_bytes, key_text, parse_drone_key
from wire.ids import DroneId

TOWER_KEY: Final = "twp_"


class MalformedIdentity(ValueError):
    """The text is not an identity. The message never contains the text."""


class NotKept(Exception):
    """What should have been kept was not, with the reason for a person."""


@dataclass(frozen=True)
class Kept:
    """What is in the file, a line each: key, credential, the tower's public key. At least one of the first two."""

    drone_id: DroneId
    key: DroneKey | None = None
    credential: Credential | None = None
    tower_key: bytes | None = None

    def __str__(self) -> str:
        lines = [str(one) for one in (self.key, self.credential) if one is not None]
        if self.tower_key is not None:
            lines.append(f"{TOWER_KEY}{key_text(self.tower_key)}")
        return "".join(f"{line}\n" for line in lines)

    def __repr__(self) -> str:
        return f"Kept(drone_id={self.drone_id}, ...)"


def parse_kept(text: str) -> Kept:
    """Raises MalformedIdentity."""
    key = credential = tower_key = None
    try:
        for line in text.split():
            if line.startswith(TOWER_KEY):
                tower_key = key_bytes(line.removeprefix(TOWER_KEY))
            elif line.startswith("twk_"):
                key = parse_drone_key(line)
            else:
                credential = parse_credential(line)
    except (MalformedKey, MalformedCredential) as error:
        raise MalformedIdentity(str(error)) from None
    ids = {one.drone_id for one in (key, credential) if one is not None}
    if len(ids) != 1:
        raise MalformedIdentity("there is no drone's key, or that of several")
    return Kept(ids.pop(), key, credential, tower_key)


def kept_nowhere(_: Kept) -> None:
    raise NotKept("nothing is kept")


class Identity:
    """`keep`: writes it down, whole or not at all, and raises NotKept; it may take as long as a disk takes."""

    def __init__(self, kept: Kept, keep: Callable[[Kept], None] = kept_nowhere) -> None:
        self._kept = kept
        self._keep = keep

    @property
    def drone_id(self) -> DroneId:
        return self._kept.drone_id

    @property
    def key(self) -> DroneKey | None:
        return self._kept.key

    @property
    def credential(self) -> Credential | None:
        """None: there is none, or it was replaced."""
        return self._kept.credential

    @property
    def tower_key(self) -> bytes | None:
        """The 32 bytes of the only tower that this drone obeys; None: it has not met one yet."""
        return self._kept.tower_key

    def make_key(self) -> DroneKey:
        """The key that replaces the credential: the same one until the exchange is complete. Raises NotKept, and then
        there is none: a key that would be lost with the process must not be shown to the tower."""
        if self._kept.key is None:
            made = DroneKey(self.drone_id, secrets.token_bytes(KEY_BYTES))
            self._change(replace(self._kept, key=made))
        assert self._kept.key is not None
        return self._kept.key

    def welcomed(self, tower_key: bytes) -> None:
        """The tower has taken the key, and proven to have its own: a credential is of no use any more. Raises NotKept;
        what is kept then still signs in."""
        wanted = replace(self._kept, credential=None, tower_key=tower_key)
        if wanted != self._kept:
            self._change(wanted)

    def _change(self, kept: Kept) -> None:
        self._keep(kept)
        self._kept = kept
