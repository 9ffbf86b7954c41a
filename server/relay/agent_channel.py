"""`/api/v1/agent`: the control channel of one agent. A thin shell: sign-in, key agreement, messages both ways."""

import asyncio
import secrets
import time
from collections import deque
from collections.abc import Callable
from typing import Final

import structlog
from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from starlette.responses import PlainTextResponse
from starlette.websockets import WebSocket, WebSocketDisconnect

from server.clock import Clock
from server.relay.agent_link import AgentLink
from server.relay.agent_routes import OVER_CHANNEL, Address
from server.relay.agent_sign_in import AgentRefused, sign_in
from server.relay.data_endpoint import DataEndpoint
from server.relay.hub import Hub
from server.relay.side_by_side import Ending, close_quietly, is_breach, until_one_ends
from wire.control_messages import (
    AGENT_SUBPROTOCOL,
    PROTOCOL,
    Hello,
    MalformedMessage,
    ResumeChallenge,
    Resumed,
    ResumeProof,
    ToAgent,
    ToTower,
    Welcome,
    decode_to_tower,
    encode_message,
)
from wire.credential import Credential
from wire.datagram_lane import DatagramLane
from wire.drops import Dropped, DropReason
from wire.ids import LinkId
from wire.key_agreement import BadPublicKey, agree, public_bytes
from wire.resuming import NONCE_BYTES, Challenge
from wire.sealed_link import SealedLink
from wire.sealing import read_link_id
from wire.transactions import TRANSACTIONS
from wire.video import VIDEO

HELLO_WITHIN_S: Final = 5.0
MOST_WAITING: Final = 256
"""Messages to an agent that does not read. Orders must not pile up and come late, so the channel is closed then."""

BAD_MESSAGE: Final = 4400
TOO_SLOW: Final = 4408
MOVED: Final = 4410
BROKEN_OFF: Final = (1005, 1006, 1011)
"""Codes of a connection that ended without anybody's wish; 1011 is what a side says that got no answer to its pings."""

_log = structlog.get_logger(__name__)


def _call_later(delay_s: float, call: Callable[[float], None]) -> None:
    asyncio.get_running_loop().call_later(delay_s, lambda: call(time.monotonic()))


class AgentChannel:
    """One agent's WebSocket, from the upgrade to its end."""

    def __init__(self, websocket: WebSocket, hub: Hub, endpoint: DataEndpoint, clock: Clock) -> None:
        self._websocket = websocket
        self._clock = clock
        self._hub = hub
        self._endpoint = endpoint
        self._outgoing: deque[ToAgent] = deque()
        self._lane = DatagramLane()
        self._something_to_send = asyncio.Event()
        self._ending = Ending()
        self._broken_off = False

    async def run(self) -> None:
        """Until either side ends it."""
        try:
            credential = sign_in(self._hub, self._websocket)
        except AgentRefused as refused:
            _log.warning("agent_refused", status=refused.status, why=refused.words)
            await self._deny(refused)
            return
        await self._websocket.accept(subprotocol=AGENT_SUBPROTOCOL)
        try:
            link = await self._greet(credential)
        except (MalformedMessage, BadPublicKey, TimeoutError) as error:
            self._hub.drops[DropReason.MALFORMED] += 1
            await close_quietly(self._websocket, BAD_MESSAGE, str(error) or "no hello in time")
            return
        except KeyError:
            self._hub.drops[DropReason.MALFORMED] += 1
            await close_quietly(self._websocket, BAD_MESSAGE, "the first message must be a hello, in text")
            return
        except WebSocketDisconnect as gone:
            self._hub.drops[DropReason.MALFORMED] += is_breach(gone.code)
            return
        log = _log.bind(drone_id=link.drone_id, link_id=link.link_id)
        try:
            await self._serve(link)
        finally:
            self._lost(link, log)

    def _lost(self, link: AgentLink, log: structlog.stdlib.BoundLogger) -> None:
        if link.channel is not self:
            return
        if not self._broken_off or self._ending.wished:
            self._hub.detach_link(link)
            log.info("link_down")
        elif self._hub.lose_channel(link, time.monotonic()):
            log.info("link_down", why="its control channel broke off")
        else:
            log.warning("link_orphaned")

    async def _deny(self, refused: AgentRefused) -> None:
        headers = {"WWW-Authenticate": "Bearer"} if refused.status == 401 else None
        await self._websocket.send_denial_response(
            PlainTextResponse(refused.words, status_code=refused.status, headers=headers)
        )

    async def _greet(self, credential: Credential) -> AgentLink:
        """The link that this channel is of: a new one, or one that the agent has proven to have."""
        hello = await self._first_words()
        if not isinstance(hello, Hello):
            raise MalformedMessage("the first message must be a hello")
        if hello.protocol != PROTOCOL:
            raise MalformedMessage(f"this tower speaks protocol {PROTOCOL}, the agent {hello.protocol}")
        link = await self._resume(hello, credential)
        if link is None:
            link = self._welcome(hello, credential)
            _log.info("link_up", drone_id=link.drone_id, link_id=link.link_id)
        else:
            _log.info("link_resumed", drone_id=link.drone_id, link_id=link.link_id)
        return link

    async def _first_words(self) -> ToTower:
        async with asyncio.timeout(HELLO_WITHIN_S):  # `wait_for` leaves what goes wrong to the garbage collector
            return decode_to_tower(await self._websocket.receive_text())

    async def _resume(self, hello: Hello, credential: Credential) -> AgentLink | None:
        """The link that the hello names, once its agent has proven that it has it. None: it is to have a new one."""
        if hello.resume is None:
            return None
        drone_id = credential.drone_id
        link = self._hub.resumable(hello.resume, drone_id, time.monotonic())
        if link is None:
            return None
        nonce = secrets.token_bytes(NONCE_BYTES)
        challenge = Challenge(link.resume_key, link_id=link.link_id, public_key=hello.public_key, nonce=nonce)
        await self._websocket.send_text(encode_message(ResumeChallenge(nonce=nonce)))
        answer = await self._first_words()
        if not isinstance(answer, ResumeProof):
            raise MalformedMessage("a challenge must be answered with a proof")
        if not challenge.agent_proves(answer.proof):
            _log.warning("link_not_resumed", drone_id=drone_id, why="the proof is wrong")
            return None
        # The link may have ended meanwhile, by whatever ends links.
        if self._hub.resumable(hello.resume, drone_id, time.monotonic()) is not link:
            return None
        link.close(MOVED, "the link goes on by another control channel")
        self._post(Resumed(link_id=link.link_id, proof=challenge.by_tower()))
        link.adopt(
            send_datagram=self._send_datagram,
            post=self._post,
            close=self._ending.wish,
            channel=self,
            waiting=self._waiting,
        )
        self._hub.resumed(link)
        return link

    def _welcome(self, hello: Hello, credential: Credential) -> AgentLink:
        link_id = self._free_link_id()
        private_key = X25519PrivateKey.generate()
        keys = agree(private_key, hello.public_key, credential_hash=credential.hashed(), link_id=link_id)
        drone = self._hub.drone(credential.drone_id)
        if drone is None:
            raise MalformedMessage("the drone has been removed")
        link = AgentLink(
            sealed=SealedLink(
                leads=False,
                link_id=link_id,
                drone_id=drone.drone_id,
                send_key=keys.tower_to_agent,
                receive_key=keys.agent_to_tower,
                now=time.monotonic(),
            ),
            send_datagram=self._send_datagram,
            post=self._post,
            close=self._ending.wish,
            call_later=_call_later,
            resume_key=keys.resume,
            channel=self,
            waiting=self._waiting,
            takes=hello.takes,
            process=hello.process,
        )
        self._post(
            Welcome(
                drone_id=drone.drone_id,
                name=drone.record.name,
                link_id=link_id,
                public_key=public_bytes(private_key),
                udp_port=self._endpoint.port,
                epoch=drone.lease.epoch,
                holder=drone.lease.holder.name if drone.lease.holder else None,
                holder_present=drone.somebody_flies(),
                takes=(TRANSACTIONS, VIDEO),
            )
        )
        self._hub.attach_link(link, time.monotonic())
        return link

    def _free_link_id(self) -> LinkId:
        while True:
            link_id = LinkId(secrets.randbits(32))
            if not self._hub.has_link_id(link_id):
                return link_id

    def _post(self, message: ToAgent) -> None:
        if len(self._outgoing) >= MOST_WAITING:
            self._ending.wish(TOO_SLOW, "the agent does not read what it is sent")
            return
        self._outgoing.append(message)
        self._something_to_send.set()

    def _waiting(self) -> tuple[int, int]:
        return len(self._outgoing), len(self._lane)

    def _send_datagram(self, datagram: bytes, address: Address) -> None:
        if address != OVER_CHANNEL:
            self._endpoint.send(datagram, address)
            return
        self._lane.put(datagram, time.monotonic())
        self._something_to_send.set()

    async def _serve(self, link: AgentLink) -> None:
        await until_one_ends(self._receive(link), self._send(), self._ending.wait())
        if self._ending.wished:
            await close_quietly(self._websocket, self._ending.code, self._ending.why)

    async def _receive(self, link: AgentLink) -> None:
        try:
            while True:
                message = await self._websocket.receive()
                if message["type"] == "websocket.disconnect":
                    self._hub.drops[DropReason.MALFORMED] += is_breach(message["code"])
                    self._broken_off = message["code"] in BROKEN_OFF
                    return
                if message.get("bytes") is not None:
                    self._datagram(link, message["bytes"])
                elif link.channel is self and self._hub.hears_report(link, time.monotonic()):
                    self._hub.report(link, decode_to_tower(message["text"]), at=self._clock())
        except (MalformedMessage, KeyError):
            self._hub.drops[DropReason.MALFORMED] += 1
            self._ending.wish(BAD_MESSAGE, "not a message of this channel")

    def _datagram(self, link: AgentLink, datagram: bytes) -> None:
        """What would have come over UDP, and is checked as if it had. A channel carries those of its own link only."""
        try:
            if read_link_id(datagram) != link.link_id or link.channel is not self:
                raise Dropped(DropReason.UNKNOWN_LINK)
            self._hub.datagram(datagram, link.link_id, OVER_CHANNEL, time.monotonic())
        except Dropped as dropped:
            self._hub.drops[dropped.reason] += 1

    async def _send(self) -> None:
        """Messages first; then datagrams for which there is no other way, as fast as the agent takes them."""
        try:
            while True:
                if self._outgoing:
                    await self._websocket.send_text(encode_message(self._outgoing.popleft()))
                elif (datagram := self._lane.take(time.monotonic())) is not None:
                    await self._websocket.send_bytes(datagram)
                    self._hub.traffic.datagrams_to_agents += 1
                    self._hub.traffic.bytes_to_agents += len(datagram)
                else:
                    self._something_to_send.clear()
                    await self._something_to_send.wait()
        except (WebSocketDisconnect, RuntimeError):
            self._broken_off = True
