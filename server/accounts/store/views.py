"""External views of accounts: the JSON of sign-in and of user administration."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from server.accounts.store.passkey_views import PasskeyAnswer
from server.accounts.store.tables import UserRow
from server.kernel.people import Role


class Strict(BaseModel):
    """A misspelt member is an error instead of being ignored."""

    model_config = ConfigDict(extra="forbid")


Secret = Annotated[str, Field(max_length=1024)]
Code = Annotated[str, Field(max_length=64, description="From the authenticator, or a recovery code")]


class SignIn(Strict):
    name: Annotated[str, Field(max_length=1024)]
    password: Secret
    code: Annotated[
        str | None, Field(max_length=64, description="From the authenticator, or a recovery code; if required")
    ] = None
    passkey: Annotated[
        PasskeyAnswer | None, Field(description="In place of a code; requested with `POST /session/passkey/options`")
    ] = None


class PasswordChange(Strict):
    old_password: Secret
    new_password: Annotated[str, Field(max_length=1024, description="12 to 256 characters, not easy to guess")]
    keep_tokens: Annotated[bool, Field(description="API tokens stay valid")] = False


class NewPassword(Strict):
    password: Secret


class PasswordJudgement(BaseModel):
    """The tower's judgement of a new password."""

    acceptable: bool
    message: Annotated[str, Field(description="Why it is not acceptable; empty if it is")]


class CodeProof(Strict):
    code: Code


class Me(BaseModel):
    """The signed-in user."""

    model_config = ConfigDict(json_schema_serialization_defaults_required=True)

    id: int
    name: str
    role: Role
    must_change_password: Annotated[bool, Field(description="Required before anything else")]
    second_factor: Annotated[bool, Field(description="Sign-in requires a second factor")]
    must_add_second_factor: Annotated[bool, Field(description="Required before anything else")] = False

    @classmethod
    def of(cls, row: UserRow, *, must_add: bool = False) -> Me:
        return cls(
            id=row.id,
            name=row.name,
            role=Role(row.role),
            must_change_password=row.must_change_password,
            second_factor=row.has_second_factor,
            must_add_second_factor=must_add,
        )


class AccountView(Me):
    """A user, as admins see them."""

    disabled: bool
    created_at: datetime
    passkeys: Annotated[int, Field(description="Number of passkeys")]

    @classmethod
    def of(cls, row: UserRow, *, must_add: bool = False) -> AccountView:
        me = Me.of(row, must_add=must_add).model_dump()
        return cls(**me, disabled=row.disabled, created_at=row.created_at, passkeys=row.passkey_count)


class NewUser(Strict):
    name: Annotated[str, Field(description="1 to 64 printable characters")]
    password: Annotated[str, Field(description="12 to 256 characters, not easy to guess")]
    role: Role = Role.OPERATOR


class UserPatch(Strict):
    """Omitted (or null) members stay as they are."""

    role: Role | None = None
    disabled: bool | None = None
    password: Annotated[str | None, Field(description="12 to 256 characters, not easy to guess")] = None
