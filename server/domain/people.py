"""People: their roles, references to them, and who is signed in with what."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum

from server.domain.scopes import ALL_SCOPES, Scope
from wire.ids import UserId


class Role(StrEnum):
    """The role of an account. `REACH` in `access.py` alone says what each one allows."""

    ADMIN = "admin"
    OPERATOR = "operator"
    OBSERVER = "observer"
    """Sees the drones it is given, and never flies."""


@dataclass(frozen=True)
class UserRef:
    id: UserId
    name: str


@dataclass(frozen=True)
class TokenId:
    """The number of an API token, where a session's could stand as well."""

    id: int


SignInId = int | TokenId
"""How a user is signed in: a session (its number) or an API token."""


@dataclass(frozen=True)
class Principal:
    """Somebody signed in."""

    user_id: UserId
    name: str
    role: Role
    session_id: SignInId
    expires_at: datetime
    """When the session ends without further use, or the token in any case."""
    proved_at: datetime | None = None
    """When this person last proved who they are (`reauthentication.py`); a token never does."""
    scopes: frozenset[Scope] = ALL_SCOPES
    """What this sign-in may be used for; what the user may do is another question."""
    must_change_password: bool = False
    must_add_second_factor: bool = False
    """An admin without one, where the tower demands it of admins."""

    @property
    def in_person(self) -> bool:
        """By a session, which only a password can begin."""
        return not isinstance(self.session_id, TokenId)

    @property
    def may_fly(self) -> bool:
        """Whether this sign-in counts as a person at the controls."""
        return Scope.FLY in self.scopes and self.role is not Role.OBSERVER

    def narrowed(self, scopes: frozenset[Scope]) -> Principal:
        """The same, for no more than `scopes`."""
        return replace(self, scopes=self.scopes & scopes)
