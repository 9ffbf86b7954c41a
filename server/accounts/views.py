"""How accounts look from outside: the JSON of sign-in and of users administration."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from server.accounts.tables import Role, UserRow


class _Strict(BaseModel):
    """A misspelt member is an error, not something that is silently left undone."""

    model_config = ConfigDict(extra="forbid")


Secret = Annotated[str, Field(max_length=1024)]
Code = Annotated[str, Field(max_length=64, description="Of the authenticator, or a recovery code")]


class SignIn(_Strict):
    name: Annotated[str, Field(max_length=1024)]
    password: Secret
    code: Annotated[
        str | None, Field(max_length=64, description="Of the authenticator, or a recovery code; where one is needed")
    ] = None


class PasswordChange(_Strict):
    old_password: Secret
    new_password: Annotated[str, Field(max_length=1024, description="8 to 256 characters of any kind")]


class OwnPassword(_Strict):
    """Asked for again before what a stolen cookie must not be able to do."""

    password: Secret


class CodeProof(_Strict):
    code: Code


class PasswordAndCode(_Strict):
    password: Secret
    code: Code


class Me(BaseModel):
    """Who is signed in."""

    id: int
    name: str
    role: Role
    must_change_password: Annotated[bool, Field(description="Nothing else may be done before")]
    second_factor: Annotated[bool, Field(description="Codes are asked for at sign-in")]

    @classmethod
    def of(cls, row: UserRow) -> Me:
        return cls(
            id=row.id,
            name=row.name,
            role=Role(row.role),
            must_change_password=row.must_change_password,
            second_factor=row.totp_sealed is not None,
        )


class AccountView(Me):
    """A user, as an admin sees them."""

    disabled: bool
    created_at: datetime

    @classmethod
    def of(cls, row: UserRow) -> AccountView:
        return cls(**Me.of(row).model_dump(), disabled=row.disabled, created_at=row.created_at)


class NewUser(_Strict):
    name: Annotated[str, Field(description="1 to 64 printable characters")]
    password: Annotated[str, Field(description="8 to 256 characters of any kind")]
    role: Role = Role.OPERATOR


class UserPatch(_Strict):
    """What is left out (or null) stays as it is."""

    role: Role | None = None
    disabled: bool | None = None
    password: Annotated[str | None, Field(description="8 to 256 characters of any kind")] = None
