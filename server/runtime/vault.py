"""Seals the few secrets that the tower must be able to read again (those of second factors), so that a copy of the
database alone is worthless. All other secrets are stored as hashes.

The keys are Fernet keys of the library `cryptography`, newest first: the first one seals, all of them open.
"""

import os
from base64 import urlsafe_b64decode
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from cryptography.fernet import Fernet, InvalidToken, MultiFernet

KEY_FILE: Final = "secret.key"
"""Default file, beside the database; one key per line."""


class VaultError(Exception):
    """The message says in one line what is wrong with the keys, and what to do. Shows no key."""


def new_key() -> str:
    """256 random bits as text."""
    return Fernet.generate_key().decode()


def parse_keys(text: str, separator: str) -> tuple[str, ...]:
    """Raises ValueError unless there is at least one key and all are valid."""
    keys = tuple(part.strip() for part in text.split(separator) if part.strip())
    if not keys:
        raise ValueError("no key")
    for key in keys:
        Fernet(key)
    return keys


class Vault:
    """Loads its keys on request. Until then it can neither seal nor open."""

    def __init__(self, *, keys: Sequence[str] = (), key_file: Path) -> None:
        self._key_file = key_file
        self._fernet: MultiFernet | None = None
        self._raw: tuple[bytes, ...] = ()
        if keys:
            self._take(keys)

    @property
    def where(self) -> str:
        """Where the keys were looked for, as text for people."""
        return f"TOWER_SECRET_KEYS is not set and there is no file {self._key_file}"

    def find_keys(self) -> bool:
        """Returns whether there are keys. Raises VaultError if the file holds anything else."""
        if self._fernet is None:
            try:
                self._take(parse_keys(self._key_file.read_text(), "\n"))
            except FileNotFoundError:
                return False
            except OSError as error:
                raise VaultError(f"the key file {self._key_file} cannot be read: {error.strerror}") from error
            except ValueError:
                raise VaultError(
                    f"the key file {self._key_file} must hold keys as `tower new-key` prints them, one a line"
                ) from None
        return True

    def make_key(self) -> None:
        """Creates a first key in the file, readable only by the tower's user. Only where nothing has been sealed
        yet."""
        try:
            self._key_file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            # Written beside and linked into place: never a partial key, and never over another process's key.
            draft = self._key_file.with_name(f".{self._key_file.name}.{os.getpid()}")
            descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            try:
                with os.fdopen(descriptor, "w") as out:
                    out.write(f"{new_key()}\n")
                    out.flush()
                    os.fsync(out.fileno())
                os.link(draft, self._key_file)
            finally:
                draft.unlink()
        except FileExistsError:
            pass  # another process was first
        except OSError as error:
            raise VaultError(f"the key file {self._key_file} cannot be made: {error.strerror}") from error
        if not self.find_keys():
            raise VaultError(f"the key file {self._key_file} cannot be made: another process was making one")

    def seal(self, secret: str, *, about: str) -> str:
        """`about`: owner and purpose. The secret opens only for the same value."""
        return self._opened().encrypt(f"{about}\n{secret}".encode()).decode()

    def open(self, sealed: str, *, about: str) -> str:
        """Raises VaultError if it was sealed with another key, for another purpose, or is damaged."""
        try:
            purpose, _, secret = self._opened().decrypt(sealed).decode().partition("\n")
        except InvalidToken:
            raise VaultError("a sealed secret cannot be opened with the keys that are here") from None
        if purpose != about:
            raise VaultError("a sealed secret was found where another one belongs")
        return secret

    def reseal(self, sealed: str) -> str:
        """Returns the same secret under the newest key. Raises VaultError if it cannot be opened."""
        try:
            return self._opened().rotate(sealed).decode()
        except InvalidToken:
            raise VaultError("a sealed secret cannot be opened with the keys that are here") from None

    def by_newest_key(self, sealed: str) -> bool:
        try:
            self._newest.decrypt(sealed)
        except InvalidToken:
            return False
        return True

    def raw_keys(self) -> tuple[bytes, ...]:
        """Newest first, for keys that are derived from them. Raises VaultError."""
        if not self.find_keys():
            raise VaultError(self.where)
        return self._raw

    def _take(self, keys: Sequence[str]) -> None:
        self._raw = tuple(urlsafe_b64decode(key) for key in keys)
        self._newest = Fernet(keys[0])
        self._fernet = MultiFernet([Fernet(key) for key in keys])

    def _opened(self) -> MultiFernet:
        if self._fernet is None:
            raise VaultError(self.where)
        return self._fernet
