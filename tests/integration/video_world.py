"""An agent with a simulated camera, and viewers: real sockets to a running tower, pictures of any size."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import socket
import time
from collections.abc import AsyncIterator, Callable
from typing import Any

import msgspec
from agent_fakes import until
from tower_world import NewDrone, TowerWorld
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from bench.key_sign_in import say_hello
from wire.control_messages import KEY_SUBPROTOCOL, Welcome, decode_to_agent, encode_message
from wire.ids import LinkId
from wire.sealed_link import SealedLink
from wire.video import (
    AGENT_VIDEO_SUBPROTOCOL,
    LIMITS,
    VIDEO,
    VIEWER_VIDEO_SUBPROTOCOL,
    CameraState,
    ClockAnswer,
    ClockProbe,
    Codec,
    Got,
    KeyWanted,
    Quality,
    Unit,
    VideoState,
    VideoWanted,
    decode_got,
    decode_unit,
    encode_unit,
)

CLOCK_AHEAD_US = 5_000_000_000
"""The agent's monotonic clock differs from the tower's."""


def agent_us() -> int:
    """Returns the agent's time."""
    return time.monotonic_ns() // 1000 + CLOCK_AHEAD_US


class CameraAgent(asyncio.DatagramProtocol):
    """A signed-in agent with a link. `wanted` is the tower's latest request. Sends what the test gives it."""

    def __init__(self, world: TowerWorld, drone: NewDrone) -> None:
        self.drone = drone
        self.wanted: VideoWanted | None = None
        self.all_wanted: list[VideoWanted] = []
        self.got: list[Got] = []
        self.keys_asked: list[KeyWanted] = []
        self.probes = 0
        self.answers_clock = True
        self._world = world
        self._numbers: dict[tuple[Quality, Codec], itertools.count[int]] = {}
        self._control: ClientConnection | None = None
        self._video: ClientConnection | None = None
        self._sealed: SealedLink | None = None
        self._udp: asyncio.DatagramTransport | None = None
        self._tasks: list[asyncio.Task[None]] = []

    # -- the link ------------------------------------------------------------------------------------------------

    async def sign_in(self, takes: tuple[str, ...] = (VIDEO,)) -> None:
        self._control = await connect(
            self._world.agent_url,
            subprotocols=[Subprotocol(KEY_SUBPROTOCOL)],
            compression=None,
            proxy=None,
        )
        sign_in = await say_hello(self._control, self.drone.key, takes=takes, process=7)
        welcome = decode_to_agent(await self._control.recv())
        assert isinstance(welcome, Welcome)
        assert VIDEO in welcome.takes
        link_id = LinkId(welcome.link_id)
        keys = sign_in.welcomed(welcome)
        self._sealed = SealedLink(
            leads=True,
            link_id=link_id,
            drone_id=self.drone.key.drone_id,
            send_key=keys.agent_to_tower,
            receive_key=keys.tower_to_agent,
            now=time.monotonic(),
        )
        loop = asyncio.get_running_loop()
        self._udp, _ = await loop.create_datagram_endpoint(
            lambda: self, remote_addr=("127.0.0.1", self._world.udp_port)
        )
        self._tasks = [asyncio.create_task(self._hear()), asyncio.create_task(self._keep_alive())]

    async def _hear(self) -> None:
        assert self._control is not None
        with contextlib.suppress(ConnectionClosed):
            async for text in self._control:
                message = decode_to_agent(text)
                if isinstance(message, VideoWanted):
                    self.wanted = message
                    self.all_wanted.append(message)

    async def _keep_alive(self) -> None:
        assert self._sealed is not None and self._udp is not None
        while True:
            for datagram in self._sealed.datagrams_to_send(time.monotonic()):
                self._udp.sendto(datagram)
            await asyncio.sleep(0.1)

    def datagram_received(self, data: bytes, addr: Any) -> None:
        assert self._sealed is not None and self._udp is not None
        received = self._sealed.receive(data, time.monotonic())
        if received.answer is not None:
            self._udp.sendto(received.answer)
        if received.urgent is not None:
            message = decode_to_agent(received.urgent)
            if isinstance(message, ClockProbe):
                self.probes += 1
                if self.answers_clock:
                    answer = ClockAnswer(number=message.number, at_us=agent_us())
                    self._udp.sendto(self._sealed.seal_urgent(encode_message(answer).encode()))

    async def announce(self, camera: CameraState, **fields: Any) -> None:
        """Reports the camera's state."""
        assert self._control is not None
        await self._control.send(encode_message(VideoState(camera=camera, **fields)))

    # -- the units -----------------------------------------------------------------------------------------------

    async def open_video(self, ticket: str | None = None) -> ClientConnection:
        if ticket is None:
            await until(lambda: self.wanted, what="to be told what is wanted")
            assert self.wanted is not None
            ticket = self.wanted.ticket
        self._video = await connect(
            f"{self._world.agent_url}/video",
            subprotocols=[Subprotocol(AGENT_VIDEO_SUBPROTOCOL)],
            additional_headers={"Authorization": f"Bearer {ticket}"},
            compression=None,
            proxy=None,
        )
        self._tasks.append(asyncio.create_task(self._hear_video(self._video)))
        return self._video

    async def _hear_video(self, video: ClientConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for message in video:
                if isinstance(message, bytes):
                    self.got.append(decode_got(message))
                else:
                    self.keys_asked.append(msgspec.json.decode(message, type=KeyWanted))

    async def send(self, *, key: bool = False, size: int = 2_000, **fields: Any) -> int:
        """Sends one picture of this many bytes, captured now. Returns its number in the stream."""
        assert self._video is not None
        unit = self.unit(key=key, size=size, **fields)
        await self._video.send(encode_unit(unit))
        return unit.sequence

    def unit(self, *, key: bool, size: int, **fields: Any) -> Unit:
        quality, codec = fields.pop("quality", Quality.MEDIUM), fields.pop("codec", Codec.MPEG1)
        numbers = self._numbers.setdefault((quality, codec), itertools.count())
        limits = LIMITS[quality]
        values: dict[str, Any] = {
            "sequence": next(numbers),
            "is_break": False,
            "capture_us": agent_us(),
            "width": limits.width,
            "height": limits.height,
            "rate_hz": limits.rate_hz,
            "bits_per_s": limits.bits_per_s,
            "held_ms": 3,
            "payload": b"\x47" * size,
        } | fields
        return Unit(quality=quality, codec=codec, key=key, **values)

    async def film(self, *, every: int = 12, rate_hz: float = 24.0, key_size: int = 7_000, size: int = 2_000) -> None:
        """Sends pictures until cancelled, every `every`-th a key."""
        due_at = time.monotonic()
        for number in itertools.count():
            is_key = number % every == 0
            await self.send(key=is_key, size=key_size if is_key else size)
            due_at += 1 / rate_hz
            await asyncio.sleep(max(0.0, due_at - time.monotonic()))

    async def close_video(self) -> None:
        assert self._video is not None
        await self._video.close()

    async def go(self) -> None:
        """Closes everything."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        for connection in (self._video, self._control):
            if connection is not None:
                await connection.close()
        if self._udp is not None:
            self._udp.close()


@contextlib.asynccontextmanager
async def camera_agent(
    world: TowerWorld, drone: NewDrone, takes: tuple[str, ...] = (VIDEO,)
) -> AsyncIterator[CameraAgent]:
    """An agent that has signed in."""
    agent = CameraAgent(world, drone)
    await agent.sign_in(takes)
    try:
        yield agent
    finally:
        await agent.go()


@contextlib.asynccontextmanager
async def filming(agent: CameraAgent, **options: Any) -> AsyncIterator[None]:
    """Sends pictures while the body runs."""
    task = asyncio.create_task(agent.film(**options))
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


class Watcher:
    """One viewer. `units` and `delays_s` of what it received, `told` all text. Acknowledges units unless told not
    to."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.units: list[Unit] = []
        self.came_at: list[float] = []
        self.reported: list[dict[str, Any]] = []
        self.says_got = True
        self.bytes_per_s: float | None = None
        """Reads no faster than this."""
        self._task = asyncio.create_task(self._read())

    async def _read(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for message in self.connection:
                if isinstance(message, str):
                    self.reported.append(json.loads(message))
                    continue
                if self.bytes_per_s is not None:
                    await asyncio.sleep(len(message) / self.bytes_per_s)
                unit = decode_unit(message)
                self.came_at.append(time.monotonic())
                self.units.append(unit)
                if self.says_got:
                    await self.connection.send(json.dumps({"type": "got", "sequence": unit.sequence}))

    def delays_s(self, since: float = 0.0) -> list[float]:
        """Returns the delays from capture to here of units received after `since`. The tower's clock is ours."""
        pairs = zip(self.units, self.came_at, strict=True)
        return [at - unit.capture_us / 1e6 for unit, at in pairs if at >= since and unit.capture_us]

    def states(self) -> list[str]:
        return [one["state"] for one in self.reported if one["type"] == "state"]

    def skipped(self) -> int:
        return sum(one["count"] for one in self.reported if one["type"] == "skipped")

    async def ask(self, **request: Any) -> None:
        await self.connection.send(json.dumps(request))

    async def until(self, condition: Callable[[], Any], what: str = "") -> Any:
        return await until(condition, what=what or str(self.reported[-3:]))

    async def until_closed(self) -> int | None:
        """Returns the code with which it closes."""
        async with asyncio.timeout(20):
            await asyncio.wait([self._task])
        return self.connection.close_code

    async def go(self) -> None:
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)
        await self.connection.close()


@contextlib.asynccontextmanager
async def watching_video(
    world: TowerWorld,
    drone_id: int | str,
    headers: dict[str, str],
    *,
    query: str = "",
    receive_buffer: int | None = None,
) -> AsyncIterator[Watcher]:
    """`headers`: of a signed-in client. `receive_buffer`: of the kernel, small for a slow reader."""
    url = world.base_url.replace("http", "ws", 1) + f"/api/v1/drones/{drone_id}/video{query}"
    own = None
    if receive_buffer is not None:
        own = socket.socket()
        own.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        host, _, port = world.base_url.removeprefix("http://").partition(":")
        own.connect((host, int(port)))
        own.setblocking(False)
    connection = await connect(
        url,
        subprotocols=[Subprotocol(VIEWER_VIDEO_SUBPROTOCOL)],
        additional_headers=headers,
        compression=None,
        proxy=None,
        max_queue=4 if receive_buffer else 256,
        sock=own,
    )
    watcher = Watcher(connection)
    try:
        yield watcher
    finally:
        await watcher.go()
