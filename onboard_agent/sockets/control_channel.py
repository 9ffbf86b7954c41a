"""Opens the control channel: connects, signs in, agrees on keys. It returns a link that is already trusted."""

import asyncio
import contextlib
import functools
import logging
import secrets
import ssl
from collections.abc import AsyncIterator, Sequence
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass, replace
from typing import Final

from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import (
    ConnectionClosed,
    ConnectionClosedOK,
    InvalidHandshake,
    InvalidStatus,
    WebSocketException,
)
from websockets.typing import Subprotocol

from onboard_agent import VERSION
from onboard_agent.link.identity import Identity, NotKept
from onboard_agent.link.signing_in import KeySignIn, NotOurTower
from onboard_agent.link.tower_url import TowerUrl
from onboard_agent.sockets.connecting import Unreachable, connect_tcp
from onboard_agent.sockets.data_socket import ANY_UPLINK
from onboard_agent.sockets.priorities import goes_first
from wire.control_messages import (
    AGENT_SUBPROTOCOL,
    KEY_SUBPROTOCOL,
    Hello,
    MalformedMessage,
    ResumeChallenge,
    Resumed,
    ResumeProof,
    SignInChallenge,
    ToAgent,
    ToTower,
    Welcome,
    decode_to_agent,
    encode_message,
)
from wire.credential import Credential
from wire.drone_key import CALLER_HEADER, DroneKey, key_text
from wire.following import FOLLOW, FOLLOW_PERSON
from wire.ids import DroneId, LinkId
from wire.key_agreement import BadPublicKey, LinkKeys, agree_by_credential, public_bytes
from wire.open_holds import OPEN_HOLDS
from wire.resuming import Challenge
from wire.sealed_link import SealedLink
from wire.sign_in import SignInPurpose
from wire.transactions import MAX_TRANSACTION_BYTES, TRANSACTIONS

UPGRADE_WITHIN_S: Final = 5.0
"""TLS and the HTTP upgrade on a slow cellular network."""
WELCOME_WITHIN_S: Final = 5.0
PING_INTERVAL_S: Final = 2.0
PING_TIMEOUT_S: Final = 5.0
"""After an outage of 2 s TCP retries only after 3.5 s, and a link that is renewed during flight by hand causes a hold.
Datagrams show whether the tower is present; a vanished control channel is detected within the sum of both."""
CLOSE_WITHIN_S: Final = 0.5
WRITE_BUFFER_BYTES: Final = 4096
"""Datagrams use this connection if UDP is blocked, and must wait where the agent can still drop them."""


REFUSED_CODE: Final = 4401

_log = logging.getLogger(__name__)


class NoLink(Exception):
    """No link this time. The message gives the reason for a person. A later attempt may succeed."""


class CredentialRefused(NoLink):
    """The tower does not accept the agent's key or credential. A retry succeeds only after a person acts."""


@dataclass(frozen=True)
class OpenedChannel:
    """A signed-in channel, its data link, and the host of the tower's UDP port."""

    connection: ClientConnection
    welcome: Welcome
    sealed: SealedLink
    host: str
    url: TowerUrl
    resume_key: bytes = b""


async def open_channel(
    url: TowerUrl,
    identity: Identity,
    *,
    uplinks: Sequence[str] = (ANY_UPLINK,),
    resuming: OpenedChannel | None = None,
    process: int = 0,
    takes: tuple[str, ...] = (TRANSACTIONS, FOLLOW, FOLLOW_PERSON, OPEN_HOLDS),
    turn: AbstractAsyncContextManager[None] | None = None,
) -> OpenedChannel:
    """Signs in over the first of `uplinks` that leads to the tower. Raises NoLink or CredentialRefused.

    Uses the drone's key. If the tower does not know it and there is an older bearer credential, uses that, and the key
    then replaces it. `resuming`: the link to continue. The result is then either that link (the same `sealed`) on
    another connection, or a new link if the tower decides so. `process`, `takes`: as in Hello. `turn`: entered for the
    hello and its answer.
    """
    opening = _Opening(url, identity, uplinks, resuming, process, takes, turn or contextlib.nullcontext())
    if identity.key is None:
        return await opening.by_credential()
    try:
        return await opening.by_key()
    except CredentialRefused:
        if identity.credential is None:
            raise
        return await opening.by_credential()


async def try_sign_in(url: TowerUrl, identity: Identity) -> str:
    """Tests the sign-in without a link; an existing link stays unchanged. Returns a description of what the tower
    accepts. Raises NoLink or CredentialRefused."""
    if identity.key is not None:
        try:
            await _Opening(url, identity, (ANY_UPLINK,), None, 0, (), contextlib.nullcontext()).trial(identity.key)
        except CredentialRefused:
            if identity.credential is None:
                raise
        else:
            return "the drone's key"
    connection = await upgrade(url, identity.credential)
    await connection.close()
    return "the credential, for which a key will be exchanged"


class _Opening:
    """One attempt to open a control channel."""

    def __init__(
        self,
        url: TowerUrl,
        identity: Identity,
        uplinks: Sequence[str],
        resuming: OpenedChannel | None,
        process: int,
        takes: tuple[str, ...],
        turn: AbstractAsyncContextManager[None],
    ) -> None:
        self._url = url
        self._turn = turn
        self._identity = identity
        self._uplinks = uplinks
        self._resuming = resuming
        self._process = process
        self._takes = takes

    async def by_key(self) -> OpenedChannel:
        async with self._upgraded(None) as connection:
            sign_in = await self._sign_in(connection, self._key, SignInPurpose.LINK)
            async with self._turn:
                hello = sign_in.hello(takes=self._takes, process=self._process)
                opened = await self._say_hello(connection, hello, sign_in)
            if opened.sealed is not (self._resuming and self._resuming.sealed):
                await self._keep(sign_in.tower_key)
            return opened

    async def by_credential(self) -> OpenedChannel:
        """Signs in by credential. Also offers a key to replace it, if the tower supports that and the key is stored."""
        try:
            await asyncio.to_thread(self._identity.make_key)
            exchanges = True
        except NotKept as error:
            _log.error("no key can take the place of the credential: %s", error)
            exchanges = False
        async with self._upgraded(self._identity.credential, exchanges=exchanges) as connection:
            if connection.subprotocol != KEY_SUBPROTOCOL:
                return await self._say_hello_of_old(connection)
            sign_in = await self._sign_in(connection, self._key, SignInPurpose.EXCHANGE)
            opened = await self._say_hello(connection, sign_in.hello(takes=self._takes, process=self._process), sign_in)
            if opened.welcome.credential_forgotten:
                await self._keep(sign_in.tower_key)
            return opened

    async def trial(self, key: DroneKey) -> None:
        async with self._upgraded(None) as connection:
            sign_in = await self._sign_in(connection, key, SignInPurpose.TRIAL)
            await connection.send(encode_message(sign_in.hello()))
            try:
                await connection.recv()
            except ConnectionClosedOK:
                return
            raise NoLink("the tower answers a trial with something else")

    @property
    def _key(self) -> DroneKey:
        key = self._identity.key
        assert key is not None
        return key

    @contextlib.asynccontextmanager
    async def _upgraded(
        self, credential: Credential | None, *, exchanges: bool = True
    ) -> AsyncIterator[ClientConnection]:
        """Connects. If its block fails, closes the connection and raises the reason as NoLink or CredentialRefused."""
        host = None if self._resuming is None else self._resuming.host
        signer = self._identity.key if credential is None else None
        connection = await upgrade(self._url, credential, self._uplinks, host, exchanges=exchanges, signer=signer)
        try:
            async with asyncio.timeout(WELCOME_WITHIN_S):
                yield connection
        except BaseException as error:
            if self._resuming is None:
                await connection.close()
            else:  # a close frame would end a link that the tower may have resumed by now
                connection.transport.abort()
            if isinstance(error, NoLink):
                raise
            if isinstance(error, TimeoutError):
                raise NoLink("the tower does not answer hello") from None
            if isinstance(error, NotOurTower):
                raise NoLink(str(error)) from None
            if isinstance(error, (MalformedMessage, BadPublicKey)):
                raise NoLink(f"the tower's welcome cannot be used: {error}") from None
            if isinstance(error, ConnectionClosed) and error.rcvd is not None and error.rcvd.code == REFUSED_CODE:
                raise CredentialRefused(f"the tower refuses this drone: {error.rcvd.reason}") from None
            if isinstance(error, WebSocketException):
                raise NoLink(f"the tower ended the connection: {error}") from None
            raise

    async def _sign_in(self, connection: ClientConnection, key: DroneKey, purpose: SignInPurpose) -> KeySignIn:
        challenge = await _hear(connection)
        if not isinstance(challenge, SignInChallenge):
            raise NoLink("the tower began with something else than a challenge")
        tls: ssl.SSLObject | None = connection.transport.get_extra_info("ssl_object")
        return KeySignIn(
            challenge,
            key=key,
            tower=self._url.name,
            tower_key=self._identity.tower_key,
            certificate=None if tls is None else tls.getpeercert(binary_form=True),
            purpose=purpose,
            private_key=X25519PrivateKey.generate(),
            random_bytes=secrets.token_bytes,
            resume=None if self._resuming is None else self._resuming.sealed.link_id,
        )

    async def _keep(self, tower_key: bytes) -> None:
        """Stores the result of the sign-in. If that fails, the link remains and the next sign-in tries again."""
        try:
            await asyncio.to_thread(self._identity.welcomed, tower_key)
        except NotKept as error:
            _log.error("the end of the credential cannot be written down: %s", error)

    async def _say_hello(self, connection: ClientConnection, hello: Hello, sign_in: KeySignIn) -> OpenedChannel:
        answer = await self._answer(connection, hello)
        if isinstance(answer, OpenedChannel):
            return answer
        return self._new_link(connection, answer, sign_in.welcomed(answer))

    async def _say_hello_of_old(self, connection: ClientConnection) -> OpenedChannel:
        """Sends the hello to a tower that does not support keys."""
        credential = self._identity.credential
        assert credential is not None
        private_key = X25519PrivateKey.generate()
        hello = Hello(
            agent_version=VERSION,
            public_key=public_bytes(private_key),
            resume=None if self._resuming is None else self._resuming.sealed.link_id,
            takes=self._takes,
            process=self._process,
        )
        answer = await self._answer(connection, hello)
        if isinstance(answer, OpenedChannel):
            return answer
        link_id, hashed = LinkId(answer.link_id), credential.hashed()
        keys = agree_by_credential(private_key, answer.public_key, credential_hash=hashed, link_id=link_id)
        return self._new_link(connection, answer, keys)

    async def _answer(self, connection: ClientConnection, hello: Hello) -> Welcome | OpenedChannel:
        """Returns the welcome, or the link that continues."""
        resuming = self._resuming
        answer = await _ask(connection, hello)
        if isinstance(answer, ResumeChallenge) and resuming is not None:
            challenge = Challenge(
                resuming.resume_key,
                link_id=resuming.sealed.link_id,
                public_key=hello.public_key,
                nonce=answer.nonce,
            )
            answer = await _ask(connection, ResumeProof(proof=challenge.by_agent()))
            if isinstance(answer, Resumed):
                if answer.link_id != resuming.sealed.link_id or not challenge.tower_proves(answer.proof):
                    raise NoLink("the tower says that our link goes on, and cannot prove that it has it")
                return replace(resuming, connection=connection)
        if not isinstance(answer, Welcome):
            raise NoLink("the tower answered hello with something else than welcome")
        if answer.drone_id != self._identity.drone_id:
            raise NoLink(f"the tower takes us for drone {answer.drone_id}, we are drone {self._identity.drone_id}")
        return answer

    def _new_link(self, connection: ClientConnection, welcome: Welcome, keys: LinkKeys) -> OpenedChannel:
        sealed = SealedLink(
            link_id=LinkId(welcome.link_id),
            drone_id=DroneId(welcome.drone_id),
            send_key=keys.agent_to_tower,
            receive_key=keys.tower_to_agent,
            now=asyncio.get_running_loop().time(),
        )
        return OpenedChannel(connection, welcome, sealed, str(connection.remote_address[0]), self._url, keys.resume)


async def _ask(connection: ClientConnection, message: ToTower) -> ToAgent:
    await connection.send(encode_message(message))
    return await _hear(connection)


async def _hear(connection: ClientConnection) -> ToAgent:
    answer = await connection.recv()
    if not isinstance(answer, str):
        raise NoLink("the tower answered hello with bytes")
    return decode_to_agent(answer)


async def upgrade(
    url: TowerUrl,
    credential: Credential | None,
    uplinks: Sequence[str] = (ANY_UPLINK,),
    host: str | None = None,
    *,
    exchanges: bool = True,
    signer: DroneKey | None = None,
) -> ClientConnection:
    """Connects without sending a hello. Raises NoLink or CredentialRefused.

    `credential`: sent with the request; None: `signer` will sign the hello. `exchanges`: there is a key to sign with.
    `uplinks`, `host`: as in `connect_tcp`.
    """
    speaks = [KEY_SUBPROTOCOL] if exchanges else []
    if credential is not None:
        speaks.append(AGENT_SUBPROTOCOL)
    headers = {} if credential is None else {"Authorization": f"Bearer {credential}"}
    if signer is not None:
        headers[CALLER_HEADER] = f"{signer.drone_id} {key_text(signer.public)}"
    try:
        sock = await connect_tcp(url, uplinks, host)
    except Unreachable as error:
        raise NoLink(str(error)) from None
    goes_first(sock)
    try:
        return await connect(
            url.channel,
            sock=sock,
            ssl=trust() if url.secure else None,
            subprotocols=[Subprotocol(name) for name in speaks],
            additional_headers=headers,
            user_agent_header=f"tower-agent/{VERSION}",
            compression=None,
            proxy=None,
            open_timeout=UPGRADE_WITHIN_S,
            ping_interval=PING_INTERVAL_S,
            ping_timeout=PING_TIMEOUT_S,
            close_timeout=CLOSE_WITHIN_S,
            max_size=MAX_TRANSACTION_BYTES,
            write_limit=WRITE_BUFFER_BYTES,
        )
    except InvalidStatus as error:
        status = error.response.status_code
        if status == 401:
            what = (
                "knows nothing of drones' keys (401)" if credential is None else "refuses this drone's credential (401)"
            )
            raise CredentialRefused(f"the tower {what}: it was revoked, or is of another tower or version") from None
        raise NoLink(f"the tower answers with HTTP status {status}") from None
    except ssl.SSLError as error:
        raise NoLink(f"the tower's certificate cannot be trusted: {error}") from None
    except TimeoutError:
        raise NoLink("the tower does not answer the upgrade") from None
    except (OSError, InvalidHandshake, WebSocketException, ValueError, EOFError) as error:
        raise NoLink(f"the tower does not speak as a tower: {error}") from None


@functools.cache
def trust() -> ssl.SSLContext:
    """Returns the system's certificates, read once: reading them takes longer than the interval of sticks."""
    return ssl.create_default_context()
