"""Many sealed agents in one process: load for a tower, on the wire the same as that many real agents.

Each signs in at /api/v1/agent with its own key and agrees on keys (with the code of the real agent), has its own UDP
socket, answers pings and sends its own. It sends stamped frames (`bench.load_frames`), so that the receiver can measure
loss and delay. Run it in another process, on another core, than the tower.

    agents = await sign_in_all(tower_url, keys)          # [LoadAgent, ...]
    async with kept_alive(agents):
        await fly(agents, Telemetry(frames_per_s=50, burst=5, kinds=STATE_KINDS), for_s=10)

Packing: the real agent collects frames up to the path MTU for at most 10 ms. An autopilot sends in bursts (the messages
of one rate together), so that a datagram carries a burst: `packed=True`, the burst is the parameter. The frames are
stamped when their datagram is sealed: the measurement covers the delay *beyond* the packing deadline. `packed=False`
sends each frame in a separate datagram.
"""

from __future__ import annotations

import asyncio
import contextlib
import random
import resource
import socket
import time
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

from bench.load_frames import EVENT_KINDS, stamped_frame
from bench.precise_timer import PreciseTimer
from onboard_agent.link.identity import Identity, parse_kept
from onboard_agent.link.tower_url import TowerUrl, parse_tower_url
from onboard_agent.sockets.control_channel import NoLink, OpenedChannel, open_channel
from wire.content import Frames
from wire.control_messages import AutopilotState, ControlChanged, ToAgent, ToTower, decode_to_agent, encode_message
from wire.drops import Dropped
from wire.following import FOLLOW, FOLLOW_PERSON
from wire.ids import Epoch
from wire.transactions import TRANSACTIONS
from wire.video import ClockAnswer, ClockProbe, VideoWanted

SIGN_IN_AT_ONCE: Final = 16
ALL_TAKE: Final = (TRANSACTIONS, FOLLOW, FOLLOW_PERSON)
KEEPALIVE_S: Final = 0.5
AT_ONCE_KEPT_ALIVE: Final = 50
MAX_RETRY_PAUSE_S: Final = 2.0
HELD_UP_S: Final = 0.02
HELD_UP_PERIODS: Final = 0.25
"""A load that the machine delays for longer than this, and than this part of its period, continues from there: it must
not catch up with a flood. With thousands of rare senders one round of the loop takes longer than HELD_UP_S."""
_EVENTS: Final = frozenset(EVENT_KINDS)


@dataclass(frozen=True, slots=True)
class Telemetry:
    """The telemetry of each drone. `burst`: frames sent together; `kinds`: message ids, in turn."""

    frames_per_s: float
    kinds: tuple[int, ...]
    burst: int = 5
    packed: bool = True

    @property
    def period_s(self) -> float:
        """From burst to burst."""
        return self.burst / self.frames_per_s


class LoadAgent:
    """One agent. `on_frames` is called with frames that the tower sends for its autopilot, `on_message` with the
    tower's messages on the control channel."""

    def __init__(self, opened: OpenedChannel) -> None:
        self._opened = opened
        self._sealed = opened.sealed
        self._sealed.keepalive.at_leisure(True)  # as an agent with one uplink whose drone has no holder
        self._sequence = 0
        self._next_kind = 0
        self.drone_id = opened.welcome.drone_id
        self.epoch = Epoch(opened.welcome.epoch)
        self.on_frames: Callable[[Frames], None] = lambda frames: None
        self.on_message: Callable[[ToAgent], None] = lambda message: None
        self.sent_frames = 0
        self.sent_events = 0
        """Transactional ones: the number of the last."""
        self.sent_datagrams = 0
        self.video_wanted: VideoWanted | None = None
        """The tower's last request, for an agent that supports video."""
        self.not_sent = 0
        """Datagrams that the local kernel did not accept."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.connect((opened.host, opened.welcome.udp_port))
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._socket, self._receive)
        self._reading = asyncio.create_task(self._read())

    @property
    def tower_port(self) -> int:
        """The UDP port of the tower."""
        return self._opened.welcome.udp_port

    @property
    def ticket(self) -> str:
        """Authorizes the agent's HTTP requests."""
        return self._opened.welcome.ticket

    async def say(self, message: ToTower) -> None:
        """Sends any message on the control channel."""
        await self.say_text(encode_message(message))

    async def say_text(self, text: str) -> None:
        """Sends any text there. Raises websockets.exceptions.ConnectionClosed."""
        await self._opened.connection.send(text)

    async def report_state(self, *, armed: bool = True, airborne: bool = True) -> None:
        """Reports that the autopilot sends heartbeats, and that the drone is airborne, unless given otherwise."""
        await self.say(AutopilotState(heard=True, armed=armed, airborne=airborne))

    def send_burst(self, telemetry: Telemetry) -> None:
        """Sends the next frames of its telemetry now."""
        now = time.monotonic()
        frames = [self._next_frame(telemetry.kinds, int(now * 1e6)) for _ in range(telemetry.burst)]
        self.send(frames, now, packed=telemetry.packed)

    def send(self, frames: Sequence[bytes], now: float, *, packed: bool = True) -> None:
        """Seals and sends any frames now."""
        batches = [frames] if packed else [[frame] for frame in frames]
        for batch in batches:
            for datagram in self._sealed.seal_frames(self.epoch, batch, now):
                self._send(datagram)
        self.sent_frames += len(frames)

    def keep_alive(self) -> None:
        """Sends a ping if one is due."""
        for datagram in self._sealed.datagrams_to_send(time.monotonic()):
            self._send(datagram)

    def _next_frame(self, kinds: tuple[int, ...], sent_us: int) -> bytes:
        msgid = kinds[self._next_kind % len(kinds)]
        self._next_kind += 1
        self._sequence += 1
        number = 0
        if msgid in _EVENTS:
            self.sent_events += 1
            number = self.sent_events
        return stamped_frame(msgid, sent_us, number, self._sequence, self.drone_id)

    def _send(self, datagram: bytes) -> None:
        try:
            self._socket.send(datagram)
            self.sent_datagrams += 1
        except OSError:
            self.not_sent += 1

    def _receive(self) -> None:
        while True:
            try:
                datagram = self._socket.recv(2048)
            except OSError:
                return
            with contextlib.suppress(Dropped):
                received = self._sealed.receive(datagram, time.monotonic())
                if received.frames is not None:
                    self.on_frames(received.frames)
                if received.urgent is not None:
                    self._answer_clock(received.urgent)

    def _answer_clock(self, urgent: bytes) -> None:
        message = decode_to_agent(urgent)
        if isinstance(message, ClockProbe):
            answer = ClockAnswer(number=message.number, at_us=time.monotonic_ns() // 1000)
            self._send(self._sealed.seal_urgent(encode_message(answer).encode()))

    async def _read(self) -> None:
        with contextlib.suppress(Exception):  # closed, by either side
            async for text in self._opened.connection:
                if isinstance(text, str):
                    message = decode_to_agent(text)
                    if isinstance(message, ControlChanged):
                        self.epoch = Epoch(max(self.epoch, message.epoch))
                    elif isinstance(message, VideoWanted):
                        self.video_wanted = message
                    self.on_message(message)

    async def close(self) -> None:
        """Disconnects."""
        self._loop.remove_reader(self._socket)
        self._socket.close()
        await self._opened.connection.close()
        self._reading.cancel()
        await asyncio.gather(self._reading, return_exceptions=True)


async def sign_in_all(
    tower_url: str,
    keys: Sequence[str],
    *,
    at_once: int = SIGN_IN_AT_ONCE,
    tries: int = 1,
    takes: tuple[str, ...] = (),
    airborne: bool = True,
) -> list[LoadAgent]:
    """Returns one agent for each key, in order. Raises onboard_agent.sockets.control_channel.NoLink after the given
    tries. `takes`: what they support beyond what every agent does. `airborne`: they report that they fly already,
    otherwise that they stand on the ground, disarmed."""
    allow_files(2 * len(keys) + 256)
    url = parse_tower_url(tower_url)
    gate = asyncio.Semaphore(at_once)

    async def sign_in(key: str) -> LoadAgent:
        async with gate:
            for tried in range(tries - 1):
                with contextlib.suppress(NoLink):
                    return await _sign_in(url, key, takes, airborne)
                await asyncio.sleep(min(0.1 * 2**tried, MAX_RETRY_PAUSE_S))
            return await _sign_in(url, key, takes, airborne)

    return list(await asyncio.gather(*(sign_in(one) for one in keys)))


async def _sign_in(url: TowerUrl, key: str, takes: tuple[str, ...], airborne: bool) -> LoadAgent:
    agent = LoadAgent(await open_channel(url, Identity(parse_kept(key), lambda _: None), takes=(*ALL_TAKE, *takes)))
    agent.keep_alive()
    await agent.report_state(armed=airborne, airborne=airborne)
    return agent


@contextlib.asynccontextmanager
async def kept_alive(agents: Sequence[LoadAgent]) -> AsyncIterator[None]:
    """Sends their pings twice per second, spread evenly, until the block ends; then disconnects all of them."""
    # Few at a time: pings of 500 agents would hold up the telemetry by more than HELD_UP_S.
    slices = max(10, len(agents) // AT_ONCE_KEPT_ALIVE)

    async def ping() -> None:
        while True:
            for one in range(slices):
                for agent in agents[one::slices]:
                    agent.keep_alive()
                await asyncio.sleep(KEEPALIVE_S / slices)

    pinging = asyncio.create_task(ping())
    try:
        yield
    finally:
        pinging.cancel()
        await asyncio.gather(pinging, *(agent.close() for agent in agents), return_exceptions=True)


async def fly(agents: Sequence[LoadAgent], telemetry: Telemetry, *, for_s: float, seed: int = 1) -> float:
    """Every agent sends its telemetry for this time. Returns the worst lateness of the load itself, in s."""
    return await paced([partial(agent.send_burst, telemetry) for agent in agents], telemetry.period_s, for_s, seed)


async def paced(senders: Sequence[Callable[[], None]], period_s: float, for_s: float, seed: int = 1) -> float:
    """Calls each sender once per period, at its own moment (from the seed). Returns the worst lateness, s."""
    chance = random.Random(seed)
    order = sorted((chance.random() * period_s, index) for index in range(len(senders)))
    timer = PreciseTimer()
    at_most_s = max(HELD_UP_S, HELD_UP_PERIODS * period_s)
    worst_s = 0.0
    held_up_s = 0.0
    try:
        for planned_s, index in _moments(time.monotonic() + 0.01, order, period_s, for_s):
            due_s = planned_s + held_up_s
            await timer.until(due_s)
            late_s = time.monotonic() - due_s
            worst_s = max(worst_s, late_s)
            if late_s > at_most_s:
                held_up_s += late_s
            senders[index]()
    finally:
        timer.close()
    return worst_s


def _moments(
    begin_s: float, order: Sequence[tuple[float, int]], period_s: float, for_s: float
) -> Iterator[tuple[float, int]]:
    for cycle in range(max(round(for_s / period_s), 1)):
        for phase_s, index in order:
            yield begin_s + cycle * period_s + phase_s, index


def allow_files(wanted: int) -> None:
    """Raises this process's limit of open files, as far as permitted."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(wanted, hard) if hard >= 0 else wanted, hard))
