"""Opens the control channel: connects, signs in, agrees on keys. What it returns is a link that is already trusted."""

import asyncio
import functools
import ssl
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidHandshake, InvalidStatus, WebSocketException
from websockets.typing import Subprotocol

from onboard_agent import VERSION
from onboard_agent.connecting import Unreachable, connect_tcp
from onboard_agent.data_socket import ANY_UPLINK
from onboard_agent.priorities import goes_first
from onboard_agent.tower_url import TowerUrl
from wire.control_messages import (
    AGENT_SUBPROTOCOL,
    Hello,
    MalformedMessage,
    ResumeChallenge,
    Resumed,
    ResumeProof,
    ToAgent,
    ToTower,
    Welcome,
    decode_to_agent,
    encode_message,
)
from wire.credential import Credential
from wire.following import FOLLOW, FOLLOW_PERSON
from wire.ids import DroneId, LinkId
from wire.key_agreement import BadPublicKey, agree, public_bytes
from wire.resuming import Challenge
from wire.sealed_link import SealedLink
from wire.transactions import LARGEST_TRANSACTION_BYTES, TRANSACTIONS

UPGRADE_WITHIN_S: Final = 5.0
"""TLS and the HTTP upgrade on a slow cellular network."""
WELCOME_WITHIN_S: Final = 5.0
PING_INTERVAL_S: Final = 2.0
PING_TIMEOUT_S: Final = 5.0
"""After a black-out of 2 s TCP tries again only after 3.5 s, and a link renewed under somebody's hand holds. Whether
the tower is there is known by the datagrams; a control channel that has vanished is noticed within the sum of both."""
CLOSE_WITHIN_S: Final = 0.5
WRITE_BUFFER_BYTES: Final = 4096
"""Datagrams travel here where UDP is blocked: what cannot leave shall wait where it can still be thrown away."""


class NoLink(Exception):
    """No link this time, with the reason for a person. Time may cure it."""


class CredentialRefused(NoLink):
    """The tower does not accept our credential. Time cures it only if somebody does."""


@dataclass(frozen=True)
class OpenedChannel:
    """A signed-in channel, its data link, and where the tower's UDP port is."""

    connection: ClientConnection
    welcome: Welcome
    sealed: SealedLink
    host: str
    resume_key: bytes = b""


async def open_channel(
    url: TowerUrl,
    credential: Credential,
    *,
    uplinks: Sequence[str] = (ANY_UPLINK,),
    resuming: OpenedChannel | None = None,
    process: int = 0,
    takes: tuple[str, ...] = (TRANSACTIONS, FOLLOW, FOLLOW_PERSON),
) -> OpenedChannel:
    """Signs in, by the first of `uplinks` that leads to the tower. Raises NoLink or CredentialRefused.

    `resuming`: the link that shall go on. Then what is returned is either that (the same `sealed`) with another
    connection, or a new link, if the tower wanted it so. `process`, `takes`: as in Hello.
    """
    connection = await upgrade(url, credential, uplinks, None if resuming is None else resuming.host)
    try:
        async with asyncio.timeout(WELCOME_WITHIN_S):
            return await _say_hello(connection, credential, resuming, process, takes)
    except BaseException as error:
        if resuming is None:
            await connection.close()
        else:  # a good-bye would end a link that the tower may have resumed by now
            connection.transport.abort()
        if isinstance(error, NoLink):
            raise
        if isinstance(error, TimeoutError):
            raise NoLink("the tower does not answer hello") from None
        if isinstance(error, (MalformedMessage, BadPublicKey)):
            raise NoLink(f"the tower's welcome cannot be used: {error}") from None
        if isinstance(error, WebSocketException):
            raise NoLink(f"the tower ended the connection: {error}") from None
        raise


async def _say_hello(
    connection: ClientConnection,
    credential: Credential,
    resuming: OpenedChannel | None,
    process: int,
    takes: tuple[str, ...],
) -> OpenedChannel:
    private_key = X25519PrivateKey.generate()
    hello = Hello(
        agent_version=VERSION,
        public_key=public_bytes(private_key),
        resume=None if resuming is None else resuming.sealed.link_id,
        takes=takes,
        process=process,
    )
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
    return _new_link(connection, credential, private_key, answer)


def _new_link(
    connection: ClientConnection, credential: Credential, private_key: X25519PrivateKey, welcome: Welcome
) -> OpenedChannel:
    if welcome.drone_id != credential.drone_id:
        raise NoLink(f"the tower takes us for drone {welcome.drone_id}, we are drone {credential.drone_id}")
    link_id = LinkId(welcome.link_id)
    keys = agree(private_key, welcome.public_key, credential_hash=credential.hashed(), link_id=link_id)
    sealed = SealedLink(
        link_id=link_id,
        drone_id=DroneId(welcome.drone_id),
        send_key=keys.agent_to_tower,
        receive_key=keys.tower_to_agent,
        now=asyncio.get_running_loop().time(),
    )
    return OpenedChannel(connection, welcome, sealed, str(connection.remote_address[0]), keys.resume)


async def _ask(connection: ClientConnection, message: ToTower) -> ToAgent:
    await connection.send(encode_message(message))
    answer = await connection.recv()
    if not isinstance(answer, str):
        raise NoLink("the tower answered hello with bytes")
    return decode_to_agent(answer)


async def upgrade(
    url: TowerUrl, credential: Credential, uplinks: Sequence[str] = (ANY_UPLINK,), host: str | None = None
) -> ClientConnection:
    """Connects and presents the credential, but says no hello yet. Raises NoLink or CredentialRefused.

    `uplinks`, `host`: as in `connect_tcp`.
    """
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
            subprotocols=[Subprotocol(AGENT_SUBPROTOCOL)],
            additional_headers={"Authorization": f"Bearer {credential}"},
            user_agent_header=f"tower-agent/{VERSION}",
            compression=None,
            proxy=None,
            open_timeout=UPGRADE_WITHIN_S,
            ping_interval=PING_INTERVAL_S,
            ping_timeout=PING_TIMEOUT_S,
            close_timeout=CLOSE_WITHIN_S,
            max_size=LARGEST_TRANSACTION_BYTES,
            write_limit=WRITE_BUFFER_BYTES,
        )
    except InvalidStatus as error:
        status = error.response.status_code
        if status == 401:
            raise CredentialRefused(
                "the tower refuses this drone's credential (401): it was revoked or belongs to another tower"
            ) from None
        raise NoLink(f"the tower answers with HTTP status {status}") from None
    except ssl.SSLError as error:
        raise NoLink(f"the tower's certificate cannot be trusted: {error}") from None
    except TimeoutError:
        raise NoLink("the tower does not answer the upgrade") from None
    except (OSError, InvalidHandshake, WebSocketException, ValueError, EOFError) as error:
        raise NoLink(f"the tower does not speak as a tower: {error}") from None


@functools.cache
def trust() -> ssl.SSLContext:
    """The system's certificates, read once: reading them takes longer than a stick's interval."""
    return ssl.create_default_context()
