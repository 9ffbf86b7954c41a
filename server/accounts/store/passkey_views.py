"""External views of passkeys. Browsers send WebAuthn's own JSON; members not listed here are ignored."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from server.accounts.store.tables import PasskeyRow

Base64Url = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]*$")]
"""Without padding, as browsers send it."""
CredentialId = Annotated[Base64Url, Field(min_length=1, max_length=1364)]
ClientData = Annotated[Base64Url, Field(min_length=1, max_length=4096)]
PasskeyName = Annotated[str, Field(description="1 to 64 printable characters, such as the device's name")]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class AssertionResponse(BaseModel):
    clientDataJSON: ClientData  # WebAuthn's names
    authenticatorData: Annotated[Base64Url, Field(min_length=1, max_length=2048)]
    signature: Annotated[Base64Url, Field(min_length=1, max_length=1024)]
    userHandle: Annotated[Base64Url, Field(max_length=128)] | None = None


class PasskeyAnswer(BaseModel):
    """The result of `navigator.credentials.get()`: `credential.toJSON()`."""

    id: CredentialId
    rawId: CredentialId
    type: Literal["public-key"]
    response: AssertionResponse


class AttestationResponse(BaseModel):
    clientDataJSON: ClientData
    attestationObject: Annotated[Base64Url, Field(min_length=1, max_length=16_384)]
    transports: Annotated[list[Annotated[str, Field(max_length=32)]], Field(max_length=16)] = []


class MadePasskey(BaseModel):
    """The result of `navigator.credentials.create()`: `credential.toJSON()`."""

    id: CredentialId
    rawId: CredentialId
    type: Literal["public-key"]
    response: AttestationResponse


class PasskeyOptions(BaseModel):
    """Options for the browser. The challenge is valid once, for five minutes, in this browser."""

    public_key: Annotated[
        dict[str, Any],
        Field(description="For `navigator.credentials`, in WebAuthn's JSON: binary members are base64url"),
    ]


class NewPasskey(_Strict):
    name: PasskeyName
    credential: MadePasskey


class PasskeySignIn(_Strict):
    credential: PasskeyAnswer


class PasskeyRename(_Strict):
    name: PasskeyName


class PasskeyView(BaseModel):
    id: int
    name: str
    made_for: Annotated[str, Field(description="The host name of the tower for which it is valid")]
    synced: Annotated[bool, Field(description="It is synchronized to several devices")]
    created_at: datetime
    last_used_at: Annotated[datetime | None, Field(description="null: never used")]

    @classmethod
    def of(cls, row: PasskeyRow) -> PasskeyView:
        return cls(
            id=row.id,
            name=row.name,
            made_for=row.party_id,
            synced=row.synced,
            created_at=row.created_at,
            last_used_at=row.last_used_at,
        )


class PasskeyAdded(BaseModel):
    passkey: PasskeyView
    recovery_codes: Annotated[
        list[str], Field(description="With an account's first factor. Only this response contains them")
    ]
