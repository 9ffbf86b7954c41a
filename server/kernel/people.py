"""People: their roles, references to them, and how they are signed in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum

from server.kernel.scopes import ALL_SCOPES, Scope
from wire.ids import UserId


class Role(StrEnum):
    """The role of an account. What each allows is defined only in `access.py` (`REACH`)."""

    ADMIN = "admin"
    OPERATOR = "operator"
    OBSERVER = "observer"
    """Sees assigned drones, and never flies."""


@dataclass(frozen=True)
class UserRef:
    id: UserId
    name: str


@dataclass(frozen=True)
class TokenId:
    """The number of an API token, where a session's number is possible as well."""

    id: int


SignInId = int | TokenId
"""How a user is signed in: by a session (its number) or an API token."""


@dataclass(frozen=True)
class Principal:
    """A signed-in user."""

    user_id: UserId
    name: str
    role: Role
    session_id: SignInId
    expires_at: datetime
    """When the session ends without further activity, or when the token ends."""
    proved_at: datetime | None = None
    """When this person last proved their identity (`reauthentication.py`); None with a token."""
    scopes: frozenset[Scope] = ALL_SCOPES
    """What this sign-in may be used for; the user's rights are checked separately."""
    must_change_password: bool = False
    must_add_second_factor: bool = False
    """An admin without a second factor, where the tower requires one of admins."""

    @property
    def in_person(self) -> bool:
        """Signed in by a session, not by a token."""
        return not isinstance(self.session_id, TokenId)

    @property
    def may_fly(self) -> bool:
        """Whether this sign-in allows being at the controls."""
        return Scope.FLY in self.scopes and self.role is not Role.OBSERVER

    def narrowed(self, scopes: frozenset[Scope]) -> Principal:
        """Returns a copy limited to `scopes`."""
        return replace(self, scopes=self.scopes & scopes)
