"""The agent's identity: the drone's key, or an older bearer credential until a key has replaced it.

Every change is stored before it takes effect. So even if a response, the agent or the tower is lost, the stored
identity signs in: first with the key, and if the tower does not know it, with the credential.
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
    """The text is not an identity. The text itself is never part of the message."""


class NotKept(Exception):
    """The identity could not be stored. The message gives the reason for a person."""


@dataclass(frozen=True)
class Kept:
    """Content of the file, one line each: key, credential, the tower's public key. At least one of the first two."""

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
    """Parses the content of the file. Raises MalformedIdentity."""
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
    """`keep`: stores the identity atomically; raises NotKept. It may take as long as a disk write takes."""

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
        """The bearer credential; None if there never was one, or a key has replaced it."""
        return self._kept.credential

    @property
    def tower_key(self) -> bytes | None:
        """Public key (32 bytes) of the only tower that this drone obeys; None if it has not met one yet."""
        return self._kept.tower_key

    def make_key(self) -> DroneKey:
        """Returns the key that replaces the credential: the same one until the exchange is complete. Raises NotKept,
        and then makes no key, because the tower must not receive a key that is lost with the process."""
        if self._kept.key is None:
            made = DroneKey(self.drone_id, secrets.token_bytes(KEY_BYTES))
            self._change(replace(self._kept, key=made))
        assert self._kept.key is not None
        return self._kept.key

    def welcomed(self, tower_key: bytes) -> None:
        """Drops the credential, because the tower has accepted the key and proven its own. Raises NotKept; the stored
        identity then still signs in."""
        wanted = replace(self._kept, credential=None, tower_key=tower_key)
        if wanted != self._kept:
            self._change(wanted)

    def _change(self, kept: Kept) -> None:
        self._keep(kept)
        self._kept = kept
