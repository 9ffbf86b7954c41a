"""Opens the control channel: connects, signs in, agrees on keys. What it returns is a link that is already trusted."""

import asyncio
import functools
import ipaddress
import socket
import ssl
from dataclasses import dataclass
from typing import Final

from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidHandshake, InvalidStatus, WebSocketException
from websockets.typing import Subprotocol

from onboard_agent import VERSION
from onboard_agent.tower_url import TowerUrl
from wire.control_messages import (
    AGENT_SUBPROTOCOL,
    LARGEST_MESSAGE_BYTES,
    Hello,
    MalformedMessage,
    Welcome,
    decode_to_agent,
    encode_message,
)
from wire.credential import Credential
from wire.ids import DroneId, LinkId
from wire.key_agreement import BadPublicKey, agree, public_bytes
from wire.sealed_link import SealedLink

CONNECT_WITHIN_S: Final = 2.0
UPGRADE_WITHIN_S: Final = 5.0
"""TLS and the HTTP upgrade on a slow cellular network."""
WELCOME_WITHIN_S: Final = 5.0
PING_INTERVAL_S: Final = 1.0
PING_TIMEOUT_S: Final = 6.0
"""After a black-out of 2 s TCP tries again only after 3.5 s, and a link renewed under somebody's hand holds."""
CLOSE_WITHIN_S: Final = 0.5
WRITE_BUFFER_BYTES: Final = 4096
"""Datagrams travel here where UDP is blocked: what cannot leave shall wait where it can still be thrown away."""
UNSENT_BYTES: Final = 8192
"""The same for the kernel's own buffer (TCP_NOTSENT_LOWAT)."""


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


async def open_channel(url: TowerUrl, credential: Credential) -> OpenedChannel:
    """Signs in. Raises NoLink or CredentialRefused."""
    connection = await upgrade(url, credential)
    try:
        host = str(connection.remote_address[0])
        private_key = X25519PrivateKey.generate()
        hello = Hello(agent_version=VERSION, public_key=public_bytes(private_key))
        async with asyncio.timeout(WELCOME_WITHIN_S):
            await connection.send(encode_message(hello))
            answer = await connection.recv()
        if not isinstance(answer, str):
            raise NoLink("the tower answered hello with bytes")
        welcome = decode_to_agent(answer)
        if not isinstance(welcome, Welcome):
            raise NoLink("the tower answered hello with something else than welcome")
        if welcome.drone_id != credential.drone_id:
            raise NoLink(f"the tower takes us for drone {welcome.drone_id}, we are drone {credential.drone_id}")
        link_id = LinkId(welcome.link_id)
        keys = agree(private_key, welcome.public_key, credential_hash=credential.hashed(), link_id=link_id)
    except BaseException as error:
        await connection.close()
        if isinstance(error, NoLink):
            raise
        if isinstance(error, TimeoutError):
            raise NoLink("the tower does not answer hello") from None
        if isinstance(error, (MalformedMessage, BadPublicKey)):
            raise NoLink(f"the tower's welcome cannot be used: {error}") from None
        if isinstance(error, WebSocketException):
            raise NoLink(f"the tower ended the connection: {error}") from None
        raise
    sealed = SealedLink(
        link_id=link_id,
        drone_id=DroneId(welcome.drone_id),
        send_key=keys.agent_to_tower,
        receive_key=keys.tower_to_agent,
        now=asyncio.get_running_loop().time(),
    )
    return OpenedChannel(connection, welcome, sealed, host)


async def upgrade(url: TowerUrl, credential: Credential) -> ClientConnection:
    """Connects and presents the credential, but says no hello yet. Raises NoLink or CredentialRefused."""
    sock = await _connect_tcp(url)
    try:
        return await connect(
            url.channel,
            sock=sock,
            ssl=_trust() if url.secure else None,
            subprotocols=[Subprotocol(AGENT_SUBPROTOCOL)],
            additional_headers={"Authorization": f"Bearer {credential}"},
            user_agent_header=f"tower-agent/{VERSION}",
            compression=None,
            proxy=None,
            open_timeout=UPGRADE_WITHIN_S,
            ping_interval=PING_INTERVAL_S,
            ping_timeout=PING_TIMEOUT_S,
            close_timeout=CLOSE_WITHIN_S,
            max_size=LARGEST_MESSAGE_BYTES,
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
def _trust() -> ssl.SSLContext:
    """The system's certificates, read once: reading them takes longer than a stick's interval."""
    return ssl.create_default_context()


async def _connect_tcp(url: TowerUrl) -> socket.socket:
    """A connected socket, trying each address that the name has. Without TLS only loopback addresses are tried."""
    loop = asyncio.get_running_loop()
    try:
        async with asyncio.timeout(CONNECT_WITHIN_S):
            found = await loop.getaddrinfo(url.host, url.port, type=socket.SOCK_STREAM)
    except (OSError, TimeoutError):
        raise NoLink(f"the name {url.host} cannot be resolved") from None
    reason = "its name has no address that may be used"
    for family, kind, protocol, _, address in found:
        if not url.secure and not ipaddress.ip_address(address[0]).is_loopback:
            continue
        sock = socket.socket(family, kind, protocol)
        sock.setblocking(False)
        try:
            async with asyncio.timeout(CONNECT_WITHIN_S):
                await loop.sock_connect(sock, address)
        except TimeoutError:
            sock.close()
            reason = "no answer"
        except OSError as error:
            sock.close()
            reason = error.strerror or str(error)
        except BaseException:
            sock.close()
            raise
        else:
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, UNSENT_BYTES)
            return sock
    raise NoLink(f"{url} cannot be reached: {reason}")
