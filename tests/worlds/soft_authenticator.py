"""An authenticator in software, with the browser around it: what a phone and Chromium send, byte by byte.

Written from WebAuthn level 3 and CTAP 2.1 with `cryptography` and `cbor2` alone, so that it shares no code with the
tower's checks. Each fault that a test needs is a keyword.
"""

import hashlib
import json
import secrets
import struct
from base64 import urlsafe_b64decode, urlsafe_b64encode
from dataclasses import dataclass, field
from typing import Any

import cbor2
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, ed25519

USER_PRESENT, USER_VERIFIED, BACKUP_ELIGIBLE, BACKED_UP, HAS_CREDENTIAL = 0x01, 0x04, 0x08, 0x10, 0x40
AAGUID = bytes(16)


def b64(data: bytes) -> str:
    return urlsafe_b64encode(data).decode().rstrip("=")


def unb64(text: str) -> bytes:
    return urlsafe_b64decode(text + "=" * (-len(text) % 4))


@dataclass
class Credential:
    id: bytes
    key: ec.EllipticCurvePrivateKey | ed25519.Ed25519PrivateKey
    party_id: str
    user_handle: bytes

    @property
    def cose_key(self) -> bytes:
        if isinstance(self.key, ed25519.Ed25519PrivateKey):
            return cbor2.dumps({1: 1, 3: -8, -1: 6, -2: self.key.public_key().public_bytes_raw()})
        numbers = self.key.public_key().public_numbers()
        x, y = (one.to_bytes(32, "big") for one in (numbers.x, numbers.y))
        return cbor2.dumps({1: 2, 3: -7, -1: 1, -2: x, -3: y})

    def sign(self, data: bytes) -> bytes:
        if isinstance(self.key, ed25519.Ed25519PrivateKey):
            return self.key.sign(data)
        return self.key.sign(data, ec.ECDSA(hashes.SHA256()))


@dataclass
class SoftAuthenticator:
    """`counts`: False for an authenticator without a signature counter, like phones that share their keys."""

    origin: str
    counts: bool = True
    is_synced: bool = False
    edwards: bool = False
    counter: int = 0
    credentials: list[Credential] = field(default_factory=list)

    def make(
        self,
        options: dict[str, Any],
        *,
        origin: str | None = None,
        party_id: str | None = None,
        is_verified: bool = True,
        kind: str = "webauthn.create",
        attestation: dict[str, Any] | None = None,
        attests_itself: bool = False,
        client_extra: dict[str, Any] | None = None,
    ) -> dict[str, Any]:
        """Acts as `navigator.credentials.create()`. Refuses if it holds one of `excludeCredentials`."""
        there = {unb64(one["id"]) for one in options.get("excludeCredentials", [])}
        if any(one.id in there for one in self.credentials):
            raise RuntimeError("InvalidStateError")
        key = ed25519.Ed25519PrivateKey.generate() if self.edwards else ec.generate_private_key(ec.SECP256R1())
        made = Credential(secrets.token_bytes(16), key, party_id or options["rp"]["id"], unb64(options["user"]["id"]))
        self.credentials.append(made)
        client_data = self._client_data(kind, options["challenge"], origin, client_extra)
        attested = AAGUID + struct.pack(">H", len(made.id)) + made.id + made.cose_key
        data = self._authenticator_data(made.party_id, is_verified, attested)
        statement = attestation or {"fmt": "none", "attStmt": {}}
        if attests_itself:
            signature = made.sign(data + hashlib.sha256(client_data).digest())
            statement = {"fmt": "packed", "attStmt": {"alg": -8 if self.edwards else -7, "sig": signature}}
        return {
            "id": b64(made.id),
            "rawId": b64(made.id),
            "type": "public-key",
            "authenticatorAttachment": "platform",
            "clientExtensionResults": {},
            "response": {
                "clientDataJSON": b64(client_data),
                "attestationObject": b64(cbor2.dumps({**statement, "authData": data})),
                "transports": ["internal", "hybrid"],
            },
        }

    def get(
        self,
        options: dict[str, Any],
        *,
        origin: str | None = None,
        party_id: str | None = None,
        challenge: str | None = None,
        is_verified: bool = True,
        counter: int | None = None,
        user_handle: bytes | None = None,
        credential: Credential | None = None,
        kind: str = "webauthn.get",
        tamper: bool = False,
        client_extra: dict[str, Any] | None = None,
    ) -> dict[str, Any]:
        """Acts as `navigator.credentials.get()`. Uses the newest credential for this tower that is allowed."""
        allowed = {unb64(one["id"]) for one in options.get("allowCredentials", [])}
        used = credential or next(
            one
            for one in reversed(self.credentials)
            if one.party_id == options["rpId"] and (not allowed or one.id in allowed)
        )
        if self.counts:
            self.counter += 1
        client_data = self._client_data(kind, challenge or options["challenge"], origin, client_extra)
        data = self._authenticator_data(party_id or used.party_id, is_verified, counter=counter)
        signature = bytearray(used.sign(data + hashlib.sha256(client_data).digest()))
        if tamper:
            signature[-1] ^= 1
        return {
            "id": b64(used.id),
            "rawId": b64(used.id),
            "type": "public-key",
            "authenticatorAttachment": "platform",
            "clientExtensionResults": {},
            "response": {
                "clientDataJSON": b64(client_data),
                "authenticatorData": b64(data),
                "signature": b64(bytes(signature)),
                "userHandle": b64(user_handle or used.user_handle),
            },
        }

    def _client_data(self, kind: str, challenge: str, origin: str | None, extra: dict[str, Any] | None) -> bytes:
        document = {"type": kind, "challenge": challenge, "origin": origin or self.origin, "crossOrigin": False}
        return json.dumps(document | (extra or {})).encode()

    def _authenticator_data(
        self, party_id: str, is_verified: bool, attested: bytes = b"", *, counter: int | None = None
    ) -> bytes:
        flags = USER_PRESENT | (USER_VERIFIED if is_verified else 0) | (HAS_CREDENTIAL if attested else 0)
        flags |= BACKUP_ELIGIBLE | BACKED_UP if self.is_synced else 0
        count = self.counter if counter is None else counter
        return hashlib.sha256(party_id.encode()).digest() + struct.pack(">BI", flags, count) + attested
