"""What passkeys are made of, without py_webauthn, which takes a tenth of the start: `webauthn_check.py` is loaded
when somebody uses a passkey."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass
from typing import Final


def from_base64url(text: str) -> bytes:
    """Padding may be missing. Raises ValueError."""
    return base64.urlsafe_b64decode(text.encode() + b"=" * (-len(text) % 4))


def to_base64url(content: bytes) -> str:
    """Without padding."""
    return base64.urlsafe_b64encode(content).rstrip(b"=").decode()


CHECK: Final = "server.accounts.core.webauthn_check"
"""To be loaded by `server.runtime.late_import` before its first use."""


class PasskeyFault(Exception):
    """An authenticator's response is invalid. `why` is for the audit trail, not for the client."""

    def __init__(self, why: str) -> None:
        super().__init__(why)
        self.why = why


@dataclass(frozen=True)
class KnownCredential:
    """A credential that an authenticator may use, or must not create again."""

    id: bytes
    transports: tuple[str, ...] = ()


@dataclass(frozen=True)
class NewCredential:
    id: bytes
    public_key: bytes
    sign_count: int
    transports: tuple[str, ...]
    synced: bool
    """It is kept in more than one device."""


@dataclass(frozen=True)
class Assertion:
    sign_count: int
    synced: bool


def challenge_in(client_data: str) -> bytes:
    """The challenge that a response claims to answer, unverified. Raises PasskeyFault."""
    try:
        document = json.loads(from_base64url(client_data))
        text, crossing = document["challenge"], document.get("crossOrigin")
        challenge = from_base64url(text) if isinstance(text, str) else b""
    except (ValueError, KeyError, TypeError, RecursionError):
        raise PasskeyFault("malformed client data") from None
    if not challenge:
        raise PasskeyFault("malformed client data")
    if crossing:
        raise PasskeyFault("made inside another site")
    return challenge
