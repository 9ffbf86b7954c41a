"""How an agent signs in to its control channel: with the drone's key, or with a bearer credential of an older version.

The work for an unknown client is bounded: one hash before the upgrade, or one X25519 key pair and one Ed25519 signature
check after it. Neither the cost nor the response reveals whether the drone exists.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from datetime import datetime
from typing import Final

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from starlette.datastructures import Headers
from starlette.requests import HTTPConnection
from starlette.types import Scope

from server.anonymous.api.anonymous_scope import admitted
from server.fleet.store.tower_identity import TowerIdentity
from server.http.private_path import is_private_path
from server.link.api.tls_binding import TlsBinding
from server.live.hub import Hub
from wire.control_messages import Hello, MalformedMessage, SignInChallenge
from wire.credential import Credential, MalformedCredential, parse_credential
from wire.drone_key import CALLER_HEADER, is_signed, key_text, public_half
from wire.ids import DroneId, LinkId
from wire.key_agreement import LinkKeys, agree, agree_by_credential, public_bytes
from wire.sign_in import NONCE_BYTES, MalformedTranscript, SignInPurpose, Transcript

NO_CREDENTIALS: Final = "this tower no longer accepts bearer credentials: enrol the drone again"
_NOBODY: Final = public_half(Ed25519PrivateKey.generate())
"""Replaces the key of a drone that does not exist: nobody has the private half."""
_NO_HASH: Final = "0" * 64

AGENT_PATH: Final = "/api/v1/agent"
MAX_ID_LENGTH: Final = 10


class AgentRefused(Exception):
    """Sign-in of an agent failed. Carries the HTTP status (401: also the close code 4401) and text for the agent's
    log."""

    def __init__(self, status: int, words: str) -> None:
        super().__init__(words)
        self.status = status
        self.words = words


Exchange = Callable[[Credential, bytes, str], Awaitable[bool | None]]
"""Registers a key for the credential's drone. False: the credential is no longer valid; None: not possible now."""


@dataclass(frozen=True)
class SignInRules:
    """Rules for the sign-in of agents."""

    identity: TowerIdentity
    binding: TlsBinding
    credentials_until: datetime | None
    """No bearer credential is accepted after this time. None: no limit."""
    exchange: Exchange


@dataclass(frozen=True)
class SignedIn:
    """An agent that has proven which drone it is."""

    hello: Hello
    drone_id: DroneId
    identity: tuple[str, bytes]
    """The identity in the drone's record that the agent has proven."""
    public_key: bytes
    """The tower's X25519 key for this sign-in."""
    keys: Callable[[LinkId], LinkKeys]
    signature: Callable[[LinkId], bytes]
    trial: bool = False
    credential_forgotten: bool = False


def read_credential(hub: Hub, connection: HTTPConnection, *, until: datetime | None, now: datetime) -> Credential:
    """Returns the bearer credential of the request, checked. Raises AgentRefused, which never says which part was
    wrong."""
    if not is_private_path(connection):
        raise AgentRefused(403, "agents must use https: a credential must not cross the network in the clear")
    if until is not None and now >= until:
        raise AgentRefused(401, NO_CREDENTIALS)
    credential = _credential(hub, connection.headers)
    admitted(connection)
    return credential


def is_agent(hub: Hub, scope: Scope) -> bool:
    """Whether one of our agents seems to sign in: after a restart of the tower a thousand sign in at once, and need not
    wait for strangers. It proves nothing: a client that knows a drone's public key only waits for less."""
    if scope["type"] != "websocket" or scope["path"] != AGENT_PATH:
        return False
    headers = Headers(scope=scope)
    drone_id, _, key = headers.get(CALLER_HEADER, "").partition(" ")
    if key and len(drone_id) <= MAX_ID_LENGTH and drone_id.isascii() and drone_id.isdigit():
        drone = hub.state.drones.get(DroneId(int(drone_id)))
        known = key_text(drone.record.public_key) if drone is not None and drone.record.public_key else ""
        return bool(known) and hmac.compare_digest(known.encode(), key.encode())
    try:
        _credential(hub, headers)
    except AgentRefused:
        return False
    return True


def _credential(hub: Hub, headers: Headers) -> Credential:
    scheme, _, text = headers.get("authorization", "").partition(" ")
    if scheme.lower() != "bearer":
        raise AgentRefused(401, "an agent signs in with its drone's key, or with 'Authorization: Bearer <credential>'")
    try:
        credential = parse_credential(text)
    except MalformedCredential as error:
        raise AgentRefused(401, str(error)) from None
    drone = hub.state.drones.get(credential.drone_id)
    known = drone.record.credential_hash if drone is not None else ""
    same = hmac.compare_digest(known or _NO_HASH, credential.hashed())
    if not known or not same:
        raise AgentRefused(401, "unknown credential")
    return credential


def by_credential(credential: Credential, hello: Hello) -> SignedIn:
    """Protocol 1: the upgrade request has carried the credential, and nothing is signed."""
    private_key = X25519PrivateKey.generate()
    hashed = credential.hashed()
    return SignedIn(
        hello=hello,
        drone_id=credential.drone_id,
        identity=(hashed, b""),
        public_key=public_bytes(private_key),
        keys=lambda link_id: agree_by_credential(
            private_key, hello.public_key, credential_hash=hashed, link_id=link_id
        ),
        signature=lambda _: b"",
    )


class KeySignIn:
    """One sign-in by key: a challenge, and the one hello that answers it."""

    def __init__(self, hub: Hub, rules: SignInRules, credential: Credential | None) -> None:
        """`credential`: from the upgrade request, to be exchanged for the key."""
        self._hub = hub
        self._rules = rules
        self._credential = credential
        self._private_key = X25519PrivateKey.generate()
        self.challenge = SignInChallenge(
            nonce=secrets.token_bytes(NONCE_BYTES),
            public_key=public_bytes(self._private_key),
            tower_key=rules.identity.public_key,
            bound=rules.binding.wanted,
        )

    async def check(self, hello: Hello, address: str) -> SignedIn:
        """Raises AgentRefused, or MalformedMessage for a hello that is not signed."""
        said = hello.sign_in
        if said is None:
            raise MalformedMessage("a hello of this protocol is signed")
        try:
            purpose = SignInPurpose(said.purpose)
            transcript = Transcript(
                purpose=purpose,
                drone_id=said.drone_id,
                tower=said.tower,
                drone_key=said.drone_key,
                tower_key=self.challenge.tower_key,
                agent_nonce=said.nonce,
                tower_nonce=self.challenge.nonce,
                agent_public_key=hello.public_key,
                tower_public_key=self.challenge.public_key,
                binding=said.binding,
                resume=hello.resume,
            )
        except (MalformedTranscript, UnicodeEncodeError) as error:
            raise MalformedMessage(str(error)) from None
        if not self._rules.binding.is_ours(said.binding):
            raise AgentRefused(
                401,
                "the agent sees another TLS certificate than this tower's: somebody is between, or "
                "TOWER_TLS_CERTIFICATE is not the one that the proxy shows",
            )
        if (purpose is SignInPurpose.EXCHANGE) != (self._credential is not None):
            raise MalformedMessage("a credential is shown for an exchange, and for nothing else")
        if self._credential is None:
            identity = self._check_known(DroneId(said.drone_id), said.signature, transcript)
            forgotten = False
        else:
            identity = await self._exchange(self._credential, said.signature, transcript, address)
            forgotten = identity[0] == ""
        return SignedIn(
            hello=hello,
            drone_id=DroneId(said.drone_id),
            identity=identity,
            public_key=self.challenge.public_key,
            keys=lambda link_id: agree(self._private_key, hello.public_key, salt=transcript.salt(), link_id=link_id),
            signature=lambda link_id: self._rules.identity.sign(transcript.for_tower(link_id)),
            trial=purpose is SignInPurpose.TRIAL,
            credential_forgotten=forgotten,
        )

    def _check_known(self, drone_id: DroneId, signature: bytes, transcript: Transcript) -> tuple[str, bytes]:
        """Checks one signature, whether the drone exists or not."""
        drone = self._hub.state.drones.get(drone_id)
        known = drone.record.public_key if drone is not None else b""
        signed = is_signed(known or _NOBODY, signature, transcript.for_agent())
        if drone is None or not known or not hmac.compare_digest(known, transcript.drone_key) or not signed:
            raise AgentRefused(401, "unknown drone key")
        return drone.record.identity

    async def _exchange(
        self, credential: Credential, signature: bytes, transcript: Transcript, address: str
    ) -> tuple[str, bytes]:
        """Registers the key for the drone. If the database is unreachable, the credential still counts: a flying drone
        must not wait for that."""
        if transcript.drone_id != credential.drone_id or not is_signed(
            transcript.drone_key, signature, transcript.for_agent()
        ):
            raise AgentRefused(401, "this key is not the agent's own")
        done = await self._rules.exchange(credential, transcript.drone_key, address)
        if done is False:
            raise AgentRefused(401, "unknown credential")
        return ("", transcript.drone_key) if done else (credential.hashed(), b"")
