"""How accounts look from outside: the JSON of sign-in and of users administration."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from server.accounts.tables import Role, UserRow


class _Strict(BaseModel):
    """A misspelt member is an error, not something that is silently left undone."""

    model_config = ConfigDict(extra="forbid")


class SignIn(_Strict):
    name: Annotated[str, Field(max_length=1024)]
    password: Annotated[str, Field(max_length=1024)]


class UserView(BaseModel):
    """Who is signed in."""

    id: int
    name: str
    role: Role


class AccountView(UserView):
    """A user, as an admin sees them."""

    disabled: bool
    created_at: datetime

    @classmethod
    def of(cls, row: UserRow) -> AccountView:
        return cls(id=row.id, name=row.name, role=Role(row.role), disabled=row.disabled, created_at=row.created_at)


class NewUser(_Strict):
    name: Annotated[str, Field(description="1 to 64 printable characters")]
    password: Annotated[str, Field(description="8 to 256 characters of any kind")]
    role: Role = Role.OPERATOR


class UserPatch(_Strict):
    """What is left out (or null) stays as it is."""

    role: Role | None = None
    disabled: bool | None = None
    password: Annotated[str | None, Field(description="8 to 256 characters of any kind")] = None
