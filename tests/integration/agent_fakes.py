"""A fake tower and autopilot for the agent's tests: real sockets on ports assigned by the kernel."""

import asyncio
import contextlib
import http
import secrets
import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from onboard_agent.agent import Agent, AgentSettings
from onboard_agent.autopilot_port.port import AutopilotPort
from onboard_agent.link.identity import Identity, Kept
from onboard_agent.link.identity_file import write_private
from onboard_agent.link.tower_url import parse_tower_url
from wire.control_messages import (
    AGENT_SUBPROTOCOL,
    KEY_SUBPROTOCOL,
    AutopilotState,
    Hello,
    HoldProgress,
    SignInChallenge,
    ToAgent,
    ToTower,
    Welcome,
    decode_to_tower,
    encode_message,
)
from wire.credential import parse_credential
from wire.dialect import build, decode, mavlink
from wire.drone_key import KEY_BYTES, DroneKey, is_signed, public_half
from wire.drops import Dropped
from wire.frame_stream import FrameStream
from wire.ids import DroneId, Epoch, LinkId
from wire.key_agreement import agree, agree_by_credential, public_bytes
from wire.sealed_link import SealedLink
from wire.sign_in import NONCE_BYTES, SignInPurpose, Transcript
from wire.video import AGENT_VIDEO_SUBPROTOCOL

DRONE = DroneId(7)
KEY = DroneKey(DRONE, b"k" * KEY_BYTES)
CREDENTIAL = parse_credential("twd_7_" + "c" * 43)
"""For a tower that does not support keys."""
TICKET = "twl_00000001_" + "t" * 43


def identity() -> Identity:
    """Returns the identity of the drone that the fake tower knows."""
    return Identity(Kept(DRONE, KEY))


def keep_key(path: Path) -> None:
    """Writes the key to a file, for an agent that runs as a process."""
    write_private(path, f"{KEY}\n")


async def until(condition: Callable[[], Any], timeout_s: float = 20.0, what: str = "") -> Any:
    """Waits for a condition, with a deadline. Returns the condition's result."""
    deadline = time.monotonic() + timeout_s
    while not (found := condition()):
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {timeout_s} s: {what}")
        await asyncio.sleep(0.005)
    return found


def signed_transcript(challenge: SignInChallenge, hello: Hello) -> Transcript | None:
    """Returns the transcript of a hello if KEY has signed it."""
    said = hello.sign_in
    assert said is not None
    transcript = Transcript(
        purpose=SignInPurpose(said.purpose),
        drone_id=said.drone_id,
        tower=said.tower,
        drone_key=said.drone_key,
        tower_key=challenge.tower_key,
        agent_nonce=said.nonce,
        tower_nonce=challenge.nonce,
        agent_public_key=hello.public_key,
        tower_public_key=challenge.public_key,
        binding=said.binding,
        resume=hello.resume,
    )
    return transcript if is_signed(KEY.public, said.signature, transcript.for_agent()) else None


class FakeTower(asyncio.DatagramProtocol):
    """Signs agents in and exchanges sealed datagrams with the newest of them."""

    def __init__(self) -> None:
        self.key = Ed25519PrivateKey.generate()
        self.is_old = False
        """True: supports no keys, only CREDENTIAL."""
        self.port = 0
        self.udp_port = 0
        self.epoch = 1
        self.holder_present = False
        self.takes: tuple[str, ...] = ()
        """Optional capabilities that the tower's welcome announces."""
        self.deaf_on_udp = False
        self.over_websocket = 0
        """Number of datagrams received over the control channel."""
        self.hellos: list[Hello] = []
        self.messages: list[ToTower] = []
        self.urgent: list[ToTower] = []
        """Messages received over the data channel."""
        self.frames: list[bytes] = []
        self.epochs_seen: list[int] = []
        self.addresses: list[Any] = []
        self.connection: ServerConnection | None = None
        self.sealed: SealedLink | None = None
        self._server: Server | None = None
        self._udp: asyncio.DatagramTransport | None = None

    def saw_autopilot(self, *, armed: bool, airborne: bool) -> bool:
        """Whether an agent reported its autopilot so, whatever else it said of it."""
        reports = [one for one in self.messages if isinstance(one, AutopilotState) and one.heard]
        return any((one.armed, one.airborne) == (armed, airborne) for one in reports)

    async def start(self, port: int = 0) -> None:
        loop = asyncio.get_running_loop()
        self._udp, _ = await loop.create_datagram_endpoint(lambda: self, local_addr=("127.0.0.1", self.udp_port))
        self.udp_port = self._udp.get_extra_info("sockname")[1]
        self._server = await serve(
            self._agent,
            "127.0.0.1",
            port,
            subprotocols=[
                Subprotocol(AGENT_SUBPROTOCOL if self.is_old else KEY_SUBPROTOCOL),
                Subprotocol(AGENT_VIDEO_SUBPROTOCOL),
            ],
            process_request=self._sign_in,
            compression=None,
        )
        self.port = next(iter(self._server.sockets)).getsockname()[1]

    async def die(self) -> None:
        """Drops every connection without a close frame, as kill -9 does."""
        if self.connection is not None:
            self.connection.transport.abort()
        if self._udp is not None:
            self._udp.close()
        if self._server is not None:
            self._server.close()
            await self._server.wait_closed()
        self.connection = self.sealed = None

    def _sign_in(self, connection: ServerConnection, request: Request) -> Response | None:
        if self.is_old and request.headers.get("Authorization") != f"Bearer {CREDENTIAL}":
            return connection.respond(http.HTTPStatus.UNAUTHORIZED, "no\n")
        return None

    async def _agent(self, connection: ServerConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            private_key = X25519PrivateKey.generate()
            challenge = SignInChallenge(
                nonce=secrets.token_bytes(NONCE_BYTES),
                public_key=public_bytes(private_key),
                tower_key=public_half(self.key),
            )
            if not self.is_old:
                await connection.send(encode_message(challenge))
            hello = decode_to_tower(str(await connection.recv()))
            assert isinstance(hello, Hello)
            link_id = LinkId(len(self.hellos) + 1)
            signature = b""
            if self.is_old:
                hashed = CREDENTIAL.hashed()
                keys = agree_by_credential(private_key, hello.public_key, credential_hash=hashed, link_id=link_id)
            else:
                transcript = signed_transcript(challenge, hello)
                if transcript is None:
                    await connection.close(4401, "unknown drone key")
                    return
                if hello.sign_in is not None and hello.sign_in.purpose == SignInPurpose.TRIAL:
                    await connection.close(1000, "the drone's key is good")
                    return
                keys = agree(private_key, hello.public_key, salt=transcript.salt(), link_id=link_id)
                signature = self.key.sign(transcript.for_tower(link_id))
            self.sealed = SealedLink(
                link_id=link_id,
                drone_id=DRONE,
                send_key=keys.tower_to_agent,
                receive_key=keys.agent_to_tower,
                now=time.monotonic(),
            )
            self.addresses = []
            self.connection = connection
            welcome = Welcome(
                drone_id=DRONE,
                name="kestrel",
                link_id=link_id,
                public_key=public_bytes(private_key),
                udp_port=self.udp_port,
                epoch=self.epoch,
                holder=None,
                holder_present=self.holder_present,
                takes=self.takes,
                signature=signature,
                ticket="" if self.is_old else TICKET,
            )
            await connection.send(encode_message(welcome))
            self.hellos.append(hello)
            async for text in connection:
                if isinstance(text, str):
                    self.messages.append(decode_to_tower(text))
                else:
                    self.over_websocket += 1

    def datagram_received(self, data: bytes, addr: Any) -> None:
        if self.deaf_on_udp or self.sealed is None or self._udp is None:
            if addr not in self.addresses:
                self.addresses.append(addr)
            return
        try:
            received = self.sealed.receive(data, time.monotonic())
        except Dropped:
            return
        if addr not in self.addresses:
            self.addresses.append(addr)
        if received.urgent is not None:
            self.urgent.append(decode_to_tower(received.urgent))
        if received.frames is not None:
            self.frames += received.frames.frames
            self.epochs_seen.append(received.frames.epoch)
        answers = [received.answer] if received.answer is not None else []
        for datagram in answers + self.sealed.datagrams_to_send(time.monotonic()):
            self._udp.sendto(datagram, addr)

    async def linked(self, times: int = 1, timeout_s: float = 20.0) -> None:
        """Waits until the agent has signed in this often and a datagram has arrived."""
        await until(lambda: len(self.hellos) >= times and self.addresses, timeout_s, f"link {times}")

    async def announce(self, message: ToAgent) -> None:
        assert self.connection is not None
        await self.connection.send(encode_message(message))

    def send_frames(self, *frames: bytes, epoch: int | None = None, drone_id: int = DRONE, late_s: float = 0.0) -> None:
        """`late_s`: simulated delay of the frames in transit."""
        assert self.sealed is not None and self._udp is not None
        self.sealed.drone_id = DroneId(drone_id)
        for datagram in self.sealed.seal_frames(
            Epoch(self.epoch if epoch is None else epoch), frames, time.monotonic() - late_s
        ):
            self._udp.sendto(datagram, self.addresses[-1])
        self.sealed.drone_id = DRONE

    def send_urgent(self, message: ToAgent) -> None:
        """Sends a message over the data channel."""
        assert self.sealed is not None
        self.send_raw(self.sealed.seal_urgent(encode_message(message).encode()))

    def send_raw(self, datagram: bytes) -> None:
        assert self._udp is not None
        self._udp.sendto(datagram, self.addresses[-1])

    def progress(self, order_id: int) -> list[HoldProgress]:
        return [m for m in self.messages if isinstance(m, HoldProgress) and m.order_id == order_id]

    def hold_steps(self, order_id: int) -> list[str]:
        return [str(m.step) for m in self.progress(order_id)]


class FakeAutopilot(asyncio.DatagramProtocol):
    """The parts of ArduCopter that the agent needs: heartbeats, mode changes, message intervals."""

    def __init__(self, *, armed: bool = False, custom_mode: int = 5) -> None:
        self.armed = armed
        self.custom_mode = custom_mode
        self.obeys_mode = True
        self.refuses: set[int] = set()
        """Modes that it refuses with FAILED."""
        self.parameters: dict[str, float] = {}
        self.alt_rel_m: float | None = None
        self.frames: list[bytes] = []
        self.port = 0
        self._stream = FrameStream()
        self._sequence = 0
        self._transport: asyncio.DatagramTransport | None = None
        self._beating: asyncio.Task[None] | None = None

    async def start(self, agent_port: int) -> None:
        loop = asyncio.get_running_loop()
        self._transport, _ = await loop.create_datagram_endpoint(
            lambda: self, local_addr=("127.0.0.1", 0), remote_addr=("127.0.0.1", agent_port)
        )
        self.port = self._transport.get_extra_info("sockname")[1]
        self._beating = asyncio.create_task(self._beat())

    def stop(self) -> None:
        assert self._transport is not None and self._beating is not None
        self._beating.cancel()
        self._transport.close()

    def say(self, message: Any) -> bytes:
        frame = build(message, system_id=1, component_id=1, sequence=self._sequence)
        self._sequence += 1
        self.send(frame)
        return frame

    def send(self, data: bytes) -> None:
        assert self._transport is not None
        self._transport.sendto(data)

    def heartbeat(self) -> None:
        mode = 0x80 if self.armed else 0
        self.say(mavlink.MAVLink_heartbeat_message(2, 3, mode | 1, self.custom_mode, 4, 3))

    def position(self, alt_rel_m: float) -> None:
        boot_ms = int(time.monotonic() * 1000) % (1 << 31)
        self.say(mavlink.MAVLink_global_position_int_message(boot_ms, 0, 0, 0, int(alt_rel_m * 1000), 0, 0, 0, 0))

    async def _beat(self) -> None:
        while True:
            self.heartbeat()
            if self.alt_rel_m is not None:
                self.position(self.alt_rel_m)
            await asyncio.sleep(0.1)

    def datagram_received(self, data: bytes, addr: Any) -> None:
        for frame in self._stream.feed(data):
            self.frames.append(frame)
            message = decode(frame)
            if message is None:
                continue
            if message.get_type() == "COMMAND_LONG":
                self._command(message)
            elif message.get_type() == "PARAM_REQUEST_READ" and message.param_id in self.parameters:
                value = self.parameters[message.param_id]
                self.say(mavlink.MAVLink_param_value_message(message.param_id.encode(), value, 9, 900, 1))

    def _command(self, message: Any) -> None:
        sets_mode = message.command == mavlink.MAV_CMD_DO_SET_MODE
        granted = not sets_mode or (self.obeys_mode and int(message.param2) not in self.refuses)
        if sets_mode and granted:
            self.custom_mode = int(message.param2)
        self.say(
            mavlink.MAVLink_command_ack_message(
                message.command, 0 if granted else 4, 0, 0, message.get_srcSystem(), message.get_srcComponent()
            )
        )
        if sets_mode:
            self.heartbeat()

    def modes_asked(self) -> list[int]:
        """Returns the requested modes in order, without immediate repetitions."""
        modes = [int(m.param2) for m in self.heard("COMMAND_LONG") if m.command == mavlink.MAV_CMD_DO_SET_MODE]
        return [mode for n, mode in enumerate(modes) if not n or modes[n - 1] != mode]

    def heard(self, kind: str) -> list[Any]:
        """Returns the received messages of this type, decoded."""
        return [m for m in map(decode, self.frames) if m is not None and m.get_type() == kind]


@contextlib.asynccontextmanager
async def running_tower() -> AsyncIterator[FakeTower]:
    tower = FakeTower()
    await tower.start()
    try:
        yield tower
    finally:
        await tower.die()


@contextlib.asynccontextmanager
async def running_agent(tower: FakeTower, port: AutopilotPort, camera: str = "none") -> AsyncIterator[Agent]:
    url = parse_tower_url(f"http://127.0.0.1:{tower.port}")
    agent = Agent(AgentSettings(tower=url, identity=identity(), port=port, camera=camera))
    task = asyncio.create_task(agent.run())
    try:
        yield agent
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


@contextlib.asynccontextmanager
async def running_autopilot(agent_port: int, *, armed: bool = False) -> AsyncIterator[FakeAutopilot]:
    autopilot = FakeAutopilot(armed=armed)
    await autopilot.start(agent_port)
    try:
        yield autopilot
    finally:
        autopilot.stop()
