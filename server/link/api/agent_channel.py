"""`/api/v1/agent`: the control channel of one agent. A thin layer: sign-in, key agreement, messages both ways."""

import asyncio
import secrets
import time
from collections import deque
from collections.abc import Callable
from typing import Final

import structlog
from starlette.responses import PlainTextResponse
from starlette.websockets import WebSocket, WebSocketDisconnect

from server import VERSION
from server.anonymous.api.anonymous_scope import admitted
from server.anonymous.api.refusal_log import log_refusal
from server.anonymous.core.budget import AnonymousBudget
from server.http.peer_address import address_of
from server.http.private_path import is_private_path
from server.kernel.clock import Clock
from server.link.api.agent_sign_in import (
    AgentRefused,
    KeySignIn,
    SignedIn,
    SignInRules,
    by_credential,
    read_credential,
)
from server.link.api.data_endpoint import DataEndpoint
from server.link.api.link_ticket import new_ticket
from server.link.api.side_by_side import Ending, close_quietly, is_breach, until_one_ends
from server.link.api.websocket.direct_websocket import direct_writer
from server.link.core.agent_link import AgentLink
from server.link.core.agent_routes import OVER_CHANNEL, Address
from server.link.core.restraint import QUARANTINED_WORDS
from server.live.hub import GOING_DOWN, Hub
from server.live.live_drone import LiveDrone
from wire.control_messages import (
    AGENT_SUBPROTOCOL,
    KEY_SUBPROTOCOL,
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
from wire.key_agreement import BadPublicKey
from wire.negotiation import TOWER_TAKES, version_of
from wire.resuming import NONCE_BYTES, Challenge
from wire.sealed_link import SealedLink
from wire.sealing import read_link_id
from wire.sign_in import SIGN_IN_PROTOCOL
from wire.tail_probes import PROBES_AFTER_S

HELLO_WITHIN_S: Final = 5.0
MAX_WAITING: Final = 256
"""Messages queued for an agent that does not read. More closes the channel, because orders must not arrive late."""

GOOD: Final = 1000
BAD_MESSAGE: Final = 4400
REFUSED: Final = 4401
TOO_SLOW: Final = 4408
MOVED: Final = 4410
BROKEN_OFF: Final = (1005, 1006, 1011)
"""Close codes of a connection that neither side ended on purpose; a peer sends 1011 when its pings get no answer."""

_log = structlog.get_logger(__name__)


def _call_later(delay_s: float, call: Callable[[float], None]) -> None:
    asyncio.get_running_loop().call_later(delay_s, lambda: call(time.monotonic()))


class AgentChannel:
    """The WebSocket of one agent, from the upgrade to its end."""

    def __init__(
        self,
        websocket: WebSocket,
        hub: Hub,
        endpoint: DataEndpoint,
        clock: Clock,
        *,
        rules: SignInRules,
        anonymous: AnonymousBudget,
    ) -> None:
        self._websocket = websocket
        self._rules = rules
        self._clock = clock
        self._anonymous = anonymous
        self._hub = hub
        self._endpoint = endpoint
        self._outgoing: deque[ToAgent] = deque()
        self._lane = DatagramLane()
        self._something_to_send = asyncio.Event()
        self._ending = Ending()
        self._broken_off = False
        self._has_told_malformed = False

    async def run(self) -> None:
        """Runs until either side ends the connection."""
        by_key = KEY_SUBPROTOCOL in self._websocket.scope["subprotocols"]
        try:
            if not self._hub.links.takes_new:
                raise AgentRefused(503, "this tower ends its work: link to another one")
            credential = self._shown(by_key)
        except AgentRefused as refused:
            log_refusal(self._anonymous, "agent_refused", refused.status, refused.words)
            await self._deny(refused)
            return
        await self._websocket.accept(subprotocol=KEY_SUBPROTOCOL if by_key else AGENT_SUBPROTOCOL)
        try:
            signed_in = await self._sign_in(credential, by_key=by_key)
            if signed_in.trial:
                await close_quietly(self._websocket, GOOD, "the drone's key is good")
                return
            admitted(self._websocket)
            link = await self._greet(signed_in)
        except AgentRefused as refused:
            log_refusal(self._anonymous, "agent_refused", refused.status, refused.words)
            await close_quietly(self._websocket, REFUSED, refused.words)
            return
        except (MalformedMessage, BadPublicKey, TimeoutError) as error:
            self._hub.state.drops[DropReason.MALFORMED] += 1
            await close_quietly(self._websocket, BAD_MESSAGE, str(error) or "no hello in time")
            return
        except KeyError:
            self._hub.state.drops[DropReason.MALFORMED] += 1
            await close_quietly(self._websocket, BAD_MESSAGE, "the first message must be a hello, in text")
            return
        except WebSocketDisconnect as gone:
            self._hub.state.drops[DropReason.MALFORMED] += is_breach(gone.code)
            return
        log = _log.bind(drone_id=link.drone_id, link_id=link.link_id)
        try:
            await self._serve(link)
        finally:
            self._lost(link, log)

    def _lost(self, link: AgentLink, log: structlog.stdlib.BoundLogger) -> None:
        if link.channel is not self:
            return
        if not self._broken_off or self._ending.requested:
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

    def _shown(self, by_key: bool) -> Credential | None:
        """Returns the credential of the upgrade request; None if the agent has none and will sign. Raises
        AgentRefused."""
        if by_key and "authorization" not in self._websocket.headers:
            if not is_private_path(self._websocket):
                raise AgentRefused(403, "agents must use https: what they say must not cross the network in the clear")
            return None
        until = self._rules.credentials_until
        return read_credential(self._hub, self._websocket, until=until, now=self._clock())

    async def _sign_in(self, credential: Credential | None, *, by_key: bool) -> SignedIn:
        """Raises AgentRefused, MalformedMessage."""
        if not by_key and credential is not None:
            hello = await self._hello(PROTOCOL)
            _log.info("agent_by_credential", drone_id=credential.drone_id, agent_version=hello.agent_version[:40])
            return by_credential(credential, hello)
        sign_in = KeySignIn(self._hub, self._rules, credential)
        await self._websocket.send_text(encode_message(sign_in.challenge))
        return await sign_in.check(await self._hello(SIGN_IN_PROTOCOL), address_of(self._websocket))

    async def _hello(self, protocol: int) -> Hello:
        hello = await self._first_words()
        if not isinstance(hello, Hello):
            raise MalformedMessage("the first message must be a hello")
        if hello.protocol != protocol:
            raise MalformedMessage(f"this tower speaks protocol {protocol} here, the agent {hello.protocol}")
        return hello

    async def _greet(self, signed_in: SignedIn) -> AgentLink:
        """Returns the link of this channel: a new one, or an existing one that the agent has proven to have."""
        link = await self._resume(signed_in)
        if link is None:
            link = self._welcome(signed_in)
            _log.info("link_up", drone_id=link.drone_id, link_id=link.link_id, agent_version=link.agent_version)
        else:
            _log.info("link_resumed", drone_id=link.drone_id, link_id=link.link_id)
        return link

    def _check_still(self, signed_in: SignedIn) -> LiveDrone:
        """The credential or key may have been revoked during the sign-in. Raises AgentRefused."""
        drone = self._hub.state.drones.get(signed_in.drone_id)
        if drone is None or drone.record.identity != signed_in.identity:
            raise AgentRefused(401, "what this agent signed in by has been revoked or replaced")
        if drone.is_quarantined:
            raise AgentRefused(403, QUARANTINED_WORDS)
        return drone

    async def _first_words(self) -> ToTower:
        async with asyncio.timeout(HELLO_WITHIN_S):  # `wait_for` leaves exceptions to the garbage collector
            return decode_to_tower(await self._websocket.receive_text())

    async def _resume(self, signed_in: SignedIn) -> AgentLink | None:
        """Returns the link that the hello names, once the agent has proven that it has it. None: it gets a new one."""
        hello, drone_id = signed_in.hello, signed_in.drone_id
        if hello.resume is None:
            return None
        link = self._hub.links.resumable(hello.resume, drone_id, time.monotonic())
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
        # The link may have ended meanwhile, for any reason.
        if self._hub.links.resumable(hello.resume, drone_id, time.monotonic()) is not link:
            return None
        self._check_still(signed_in)
        link.close(MOVED, "the link goes on by another control channel")
        self._post(Resumed(link_id=link.link_id, proof=challenge.by_tower()))
        link.adopt(
            send_datagram=self._send_datagram,
            post=self._post,
            close=self._ending.request,
            channel=self,
            waiting=self._waiting,
        )
        self._hub.resumed(link)
        return link

    def _welcome(self, signed_in: SignedIn) -> AgentLink:
        link_id = self._free_link_id()
        keys = signed_in.keys(link_id)
        drone = self._check_still(signed_in)
        hello = signed_in.hello
        ticket = new_ticket(link_id)
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
            close=self._ending.request,
            call_later=_call_later,
            resume_key=keys.resume,
            channel=self,
            waiting=self._waiting,
            takes=hello.takes,
            process=hello.process,
            ticket=ticket,
            agent_version=version_of(hello.agent_version),
            drops=self._hub.state.drops,
        )
        self._post(
            Welcome(
                drone_id=drone.drone_id,
                name=drone.record.name,
                link_id=link_id,
                public_key=signed_in.public_key,
                udp_port=self._endpoint.port,
                epoch=drone.lease.epoch,
                holder=drone.lease.holder.name if drone.lease.holder else None,
                holder_present=drone.somebody_flies(),
                takes=TOWER_TAKES,
                tower_version=VERSION,
                signature=signed_in.signature(link_id),
                credential_forgotten=signed_in.credential_forgotten,
                ticket=ticket,
                towers=self._hub.links.towers,
            )
        )
        self._hub.attach_link(link, time.monotonic())
        return link

    def _free_link_id(self) -> LinkId:
        while True:
            link_id = LinkId(secrets.randbits(32))
            if link_id not in self._hub.state.links:
                return link_id

    def _post(self, message: ToAgent) -> None:
        if len(self._outgoing) >= MAX_WAITING:
            self._ending.request(TOO_SLOW, "the agent does not read its messages")
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
        if self._ending.requested:
            await close_quietly(self._websocket, self._ending.code, self._ending.why)

    async def _receive(self, link: AgentLink) -> None:
        while True:
            message = await self._websocket.receive()
            if message["type"] == "websocket.disconnect":
                self._hub.state.drops[DropReason.MALFORMED] += is_breach(message["code"])
                self._broken_off = message["code"] in BROKEN_OFF
                return
            if message.get("bytes") is not None:
                self._datagram(link, message["bytes"])
            elif link.channel is self and self._hub.admits_report(link, time.monotonic()):
                self._report(link, message["text"])

    def _report(self, link: AgentLink, text: str) -> None:
        """A message that cannot be read costs itself and never the link: the drone may be in the air."""
        try:
            self._hub.reports.receive(link, decode_to_tower(text), at=self._clock())
        except MalformedMessage as error:
            self._hub.state.drops[DropReason.MALFORMED] += 1
            if not self._has_told_malformed:
                self._has_told_malformed = True
                _log.warning("agent_message_dropped", drone_id=link.drone_id, why=str(error)[:200])
        except Exception as error:
            self._hub.state.on_fault("reports", link.drone_id, error)

    def _datagram(self, link: AgentLink, datagram: bytes) -> None:
        """Handles a datagram tunnelled in the channel, with the same checks as UDP. A channel carries those of its own
        link only."""
        try:
            if read_link_id(datagram) != link.link_id or link.channel is not self:
                raise Dropped(DropReason.UNKNOWN_LINK)
            self._hub.datagram(datagram, link.link_id, OVER_CHANNEL, time.monotonic())
        except Dropped as dropped:
            self._hub.state.drops[dropped.reason] += 1
        except Exception as error:
            self._hub.state.on_fault("datagrams", link.drone_id, error)

    async def _send(self) -> None:
        """Sends messages first, then datagrams that have no other path, as fast as the agent reads."""
        try:
            while True:
                if not self._endpoint.may_act():
                    self._ending.request(GOING_DOWN, "another process may be the tower")
                    return
                if self._outgoing:
                    await self._websocket.send_text(encode_message(self._outgoing.popleft()))
                elif (datagram := self._lane.pop(time.monotonic())) is not None:
                    await self._websocket.send_bytes(datagram)
                    self._hub.state.traffic.datagrams_to_agents += 1
                    self._hub.state.traffic.bytes_to_agents += len(datagram)
                else:
                    self._something_to_send.clear()
                    await self._wait_with_probes()
        except (WebSocketDisconnect, RuntimeError):
            self._broken_off = True

    async def _wait_with_probes(self) -> None:
        for pause_s in PROBES_AFTER_S:
            try:
                async with asyncio.timeout(pause_s):
                    await self._something_to_send.wait()
                    return
            except TimeoutError:
                direct_writer(self._websocket).write_pong()
        await self._something_to_send.wait()
