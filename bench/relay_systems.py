"""The systems measured side by side, ours and its peers: how each is started, fed by senders, and read."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import socket
import sys
import time
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from bench.lean_browser import LeanBrowser, connect_browser
from bench.load_agents import LoadAgent, Telemetry, kept_alive, sign_in_all
from bench.load_frames import EVENT_KINDS, STATE_KINDS, read_plain, read_tagged, stamped_frame
from bench.load_tower import LoadTower, end, load_tower
from bench.pilot_sticks import STICKS_S, answer_ping, stick, stick_number, take
from bench.relay_sink import Sink
from wire.content import Frames
from wire.ids import DroneId

PEERS: Final = Path(__file__).resolve().parent / "peers"
START_S: Final = 30.0
RECEIVE_BUFFER_BYTES: Final = 1 << 20


@dataclass(frozen=True, slots=True)
class Pattern:
    """How frames arrive from the autopilots."""

    name: str
    burst: int
    packed: bool = True


@dataclass
class Running:
    """A system under test."""

    name: str
    pid: int
    sink: Sink
    senders: Callable[[float, Pattern], list[Callable[[], None]]]
    """(frames per second of each drone, pattern) to one sender of a burst for each drone."""
    sent: Callable[[], int]
    """Frames sent so far."""
    tower: LoadTower | None = None
    agents: list[LoadAgent] | None = None


System = Callable[[Path, int], contextlib.AbstractAsyncContextManager[Running]]
"""(its own folder, number of drones) to a running system."""


@contextlib.asynccontextmanager
async def ours(
    folder: Path,
    drones: int,
    *,
    kinds: tuple[int, ...] = EVENT_KINDS,
    watch_rate_hz: float = 0.0,
    focus: bool = False,
    flown: bool = False,
) -> AsyncIterator[Running]:
    """The tower, with a browser that watches. With transactional kinds every frame must arrive, and at once. `focus`:
    it watches the first drone closely. `flown`: it flies that one, with sticks 50 times per second."""
    async with load_tower(folder, drones=drones, cpus=under_test()) as tower:
        agents = await sign_in_all(tower.url, tower.keys)
        sink = Sink(read_tagged)
        browser = await tower.browser()
        browser.on_binary = sink.take
        if watch_rate_hz:
            browser.send_text(json.dumps({"type": "watch", "rate_hz": watch_rate_hz}))

        if focus:
            sink.close_to = agents[0].drone_id
            browser.send_text(json.dumps({"type": "focus", "drone_id": sink.close_to}))

        def senders(rate: float, pattern: Pattern) -> list[Callable[[], None]]:
            telemetry = Telemetry(rate, kinds, burst=pattern.burst, packed=pattern.packed)
            return [partial(agent.send_burst, telemetry) for agent in agents]

        sticks = flown_by(tower, browser, agents[0], sink) if flown else contextlib.nullcontext()
        async with kept_alive(agents), sticks:
            yield Running(
                "ours",
                tower.process.pid,
                sink,
                senders,
                lambda: sum(agent.sent_frames for agent in agents),
                tower,
                agents,
            )


@contextlib.asynccontextmanager
async def flown_by(tower: LoadTower, browser: LeanBrowser, agent: LoadAgent, sink: Sink) -> AsyncIterator[None]:
    """The browser's user holds the agent's drone, and sends it sticks until the block ends."""
    sent: dict[int, float] = {}

    def came(frames: Frames) -> None:
        now_us = time.monotonic() * 1e6
        for number in filter(None, map(stick_number, frames.frames)):
            if number in sent:
                sink.sticks_us.append(now_us - sent.pop(number))

    async def fly() -> None:
        number, due = 0, time.monotonic()
        while True:
            number = number % 0xFFFF + 1
            sent[number] = time.monotonic() * 1e6
            browser.send_binary(stick(DroneId(agent.drone_id), number))
            due = max(due + STICKS_S, time.monotonic())
            await asyncio.sleep(due - time.monotonic())

    agent.on_frames = came
    browser.on_text = lambda text: answer_ping(browser, text)
    await take(tower, agent.drone_id, "acquire")
    flying = asyncio.create_task(fly())
    try:
        yield
    finally:
        flying.cancel()
        await asyncio.gather(flying, return_exceptions=True)


class PlainDrones:
    """One UDP socket per drone; they send plain MAVLink, one frame per datagram, to one port."""

    def __init__(self, drones: int, port: int) -> None:
        self.sent = 0
        self._sequence = 0
        self._sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(drones)]
        for one in self._sockets:
            one.setblocking(False)
            one.connect(("127.0.0.1", port))

    def senders(self, rate: float, pattern: Pattern) -> list[Callable[[], None]]:
        return [partial(self._burst, one, pattern.burst) for one in self._sockets]

    def _burst(self, one: socket.socket, burst: int) -> None:
        sent_us = int(time.monotonic() * 1e6)
        for _ in range(burst):
            self._sequence += 1
            kind = STATE_KINDS[self._sequence % len(STATE_KINDS)]
            with contextlib.suppress(OSError):
                one.send(stamped_frame(kind, sent_us, 0, self._sequence))
            self.sent += 1

    def close(self) -> None:
        for one in self._sockets:
            one.close()


@contextlib.asynccontextmanager
async def to_websocket(folder: Path, drones: int, *, library: bool = False) -> AsyncIterator[Running]:
    """The bare uvloop forwarder."""
    ports = folder / "ports"
    words = [sys.executable, str(PEERS / "udp_to_websocket.py"), str(ports), *(["--library"] if library else [])]
    async with _process(folder, *words) as process:
        udp_port, tcp_port = map(int, (await _written(ports, process)).split())
        plain = PlainDrones(drones, udp_port)
        sink = Sink(read_plain)
        browser = await connect_browser(f"http://127.0.0.1:{tcp_port}", path="/")
        browser.on_binary = sink.take
        try:
            yield Running("forwarder", process.pid, sink, plain.senders, lambda: plain.sent)
        finally:
            browser.close()
            plain.close()


@contextlib.asynccontextmanager
async def in_c(folder: Path, drones: int) -> AsyncIterator[Running]:
    """recvfrom and sendto. Raises FileNotFoundError without a compiler."""
    program, port = folder / "udp_forward", folder / "port"
    compiler = await asyncio.create_subprocess_exec("gcc", "-O2", "-o", str(program), str(PEERS / "udp_forward.c"))
    if await compiler.wait():
        raise RuntimeError("gcc failed")
    sink = Sink(read_plain)
    with udp_sink(sink) as out_port:
        async with _process(folder, str(program), str(out_port), str(port)) as process:
            plain = PlainDrones(drones, int(await _written(port, process)))
            try:
                yield Running("c", process.pid, sink, plain.senders, lambda: plain.sent)
            finally:
                plain.close()


@contextlib.asynccontextmanager
async def mavproxy(folder: Path, drones: int, *, program: Path, modules: bool) -> AsyncIterator[Running]:
    """MAVProxy as a UDP router from one port to another, with its default modules or with none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        in_port = probe.getsockname()[1]
    sink = Sink(read_plain)
    with udp_sink(sink) as out_port:
        words = [
            str(program.with_name("python")),
            str(program),
            f"--master=udpin:127.0.0.1:{in_port}",
            f"--out=udpout:127.0.0.1:{out_port}",
            "--non-interactive",
            f"--state-basedir={folder}",
            *([] if modules else ["--default-modules="]),
        ]
        async with _process(folder, *words) as process:
            plain = PlainDrones(drones, in_port)
            senders = plain.senders(1, Pattern("", 1))
            try:
                async with asyncio.timeout(START_S):
                    while not sink.frames:  # it takes seconds to load
                        senders[0]()
                        await asyncio.sleep(0.2)
                yield Running("mavproxy", process.pid, sink, plain.senders, lambda: plain.sent)
            finally:
                plain.close()


@contextlib.contextmanager
def udp_sink(sink: Sink) -> Iterator[int]:
    """Yields a UDP port whose datagrams go to the sink."""
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
    receiver.setblocking(False)
    receiver.bind(("127.0.0.1", 0))

    def drain() -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                sink.take(receiver.recv(2048))

    loop = asyncio.get_running_loop()
    loop.add_reader(receiver, drain)
    try:
        yield receiver.getsockname()[1]
    finally:
        loop.remove_reader(receiver)
        receiver.close()


def share_processors() -> bool:
    """Keeps this process off one processor, for the systems under test. False if there is only one."""
    mine = os.sched_getaffinity(0)
    if len(mine) < 2:
        return False
    os.sched_setaffinity(0, mine - {min(mine)})
    return True


def under_test() -> set[int] | None:
    """Returns the processor for a system under test; None before `share_processors`, or if there is only one."""
    return set(range(os.cpu_count() or 1)) - os.sched_getaffinity(0) or None


@contextlib.asynccontextmanager
async def _process(folder: Path, *words: str) -> AsyncIterator[asyncio.subprocess.Process]:
    with (folder / "peer.log").open("wb") as log:
        process = await asyncio.create_subprocess_exec(
            *words, stdin=asyncio.subprocess.DEVNULL, stdout=log, stderr=log, cwd=folder
        )
    try:
        cpus = under_test()
        if cpus:
            os.sched_setaffinity(process.pid, cpus)
        yield process
    finally:
        await end(process)


async def _written(file: Path, process: asyncio.subprocess.Process) -> str:
    async with asyncio.timeout(START_S):
        while not (file.exists() and file.read_text()):  # noqa: ASYNC240
            if process.returncode is not None:
                raise RuntimeError(f"it ended: {(file.parent / 'peer.log').read_text()[-1000:]}")
            await asyncio.sleep(0.02)
        return file.read_text()  # noqa: ASYNC240
