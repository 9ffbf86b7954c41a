"""A tower process under attack: a fleet, the holder of the first drone, and a witness who only watches it.

Drone 1 flies and is watched; drone 2's link is mutated below and above the seal; the others are attacked as their own
agents. Flood limits are raised: this tests the content of messages, not their number.
"""

from __future__ import annotations

import asyncio
import contextlib
import random
import re
import socket
import time
from collections import Counter
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import httpx

from bench.fuzz_channels import Account, Target, attack_agent, attack_live_in_bytes, attack_live_in_text
from bench.fuzz_datagrams import DatagramFuzzer
from bench.fuzz_video import attack_video_in_bytes, attack_video_in_text
from bench.lean_browser import LeanBrowser
from bench.load_agents import LoadAgent, kept_alive, sign_in_all
from bench.load_frames import EVENT_KINDS, STATE_KINDS, read_plain, stamped_frame
from bench.load_tower import LoadTower, load_tower
from bench.process_cost import rss_mb
from wire.content import Frames
from wire.tagged import split_tagged

_FRAMES_PER_S: Final = 20.0
_AS_AGENTS: Final = 30
_MAX: Final = "1000000"
_WITHOUT_FLOOD_GATE: Final = {
    f"TOWER_{whose}_FRAMES_{what}": _MAX for whose in ("USER", "DRONE", "AGENT") for what in ("PER_S", "BURST")
} | {"TOWER_USER_VIDEO_SOCKETS": "100000", "TOWER_ADDRESS_VIDEO_SOCKETS": "100000"}
_PROGRESS: Final = {
    "type": "hold_progress",
    "order_id": 1,
    "epoch": 1,
    "step": "confirmed",
    "detail": "ALT_HOLD",
    "elapsed_ms": 12.5,
}


class Witness:
    """A browser that behaves correctly while others do not."""

    def __init__(self, browser: LeanBrowser, agent: LoadAgent) -> None:
        self.delays_ms: list[float] = []
        self._agent = agent
        self._numbers: set[int] = set()
        self._sent = 0
        browser.on_binary = self._came
        browser.send_text('{"type":"focus","drone_id":1}')

    async def _fly(self) -> None:
        while True:
            self._sent += 1
            now = time.monotonic()
            frames = [
                stamped_frame(STATE_KINDS[0], int(now * 1e6), 0, self._sent),
                stamped_frame(EVENT_KINDS[0], int(now * 1e6), self._sent, self._sent),
            ]
            self._agent.send(frames, now)
            await asyncio.sleep(1 / _FRAMES_PER_S)

    def start(self) -> None:
        """Starts the drone's flight."""
        self._flying = asyncio.create_task(self._fly())

    async def stop(self) -> None:
        """Ends the flight. No effect if already stopped."""
        self._flying.cancel()
        await asyncio.gather(self._flying, return_exceptions=True)

    def lost(self) -> int:
        """Events that did not arrive."""
        return self._sent - len(self._numbers)

    def _came(self, message: bytes) -> None:
        now_us = time.monotonic() * 1e6
        for drone_id, frame in split_tagged(message):
            # For drone 2 the mutated frames arrive; for drone 1 also the tower's denials.
            for arrived in read_plain(frame) if drone_id == 1 else ():
                self.delays_ms.append((now_us - arrived.sent_us) / 1e3)
                if arrived.number:
                    self._numbers.add(arrived.number)


@dataclass
class FuzzedTower:
    """See the module docstring."""

    tower: LoadTower
    target: Target
    witness: Witness
    agents: list[LoadAgent]
    log: Path
    _http: httpx.AsyncClient
    _arrived: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        def came(frames: Frames) -> None:
            self._arrived += len(frames.frames)

        for agent in self.agents:
            agent.on_frames = came

    @property
    def alive(self) -> bool:
        """Whether the process is still running."""
        return self.tower.process.returncode is None

    def rss_mb(self) -> float:
        """Of the tower."""
        return rss_mb(self.tower.process.pid)

    def errors_in_log(self) -> list[str]:
        """Returns lines of level error or above, and lines that are not log lines."""
        lines = self.log.read_text(errors="replace").splitlines()
        return [line for line in lines if '"error"' in line or '"critical"' in line or "Traceback" in line]

    async def drone_online(self, drone_id: int) -> bool:
        """Returns the tower's view."""
        answer = await self._http.get(f"/api/v1/drones/{drone_id}")
        return answer.status_code == 200 and bool(answer.json()["online"])

    async def drops(self) -> Counter[str]:
        """Returns everything that the tower has counted as dropped, by reason, from its metrics."""
        answer = await self._http.get("/metrics")
        answer.raise_for_status()
        found = re.findall(r'^tower_drops_total\{reason="([^"]+)"\} (\S+)', answer.text, re.MULTILINE)
        return Counter({reason: int(float(count)) for reason, count in found})

    async def attack(self, kind: str, chance: random.Random, messages: int) -> Account:
        """`kind`: as in bench.fuzz."""
        if kind == "live, bytes":
            return await attack_live_in_bytes(self.target, chance, messages, arrived=lambda: self._arrived)
        if kind == "live, text":
            return await attack_live_in_text(self.target, chance, messages)
        if kind == "video, bytes":
            return await attack_video_in_bytes(self.target, chance, messages)
        if kind == "video, text":
            return await attack_video_in_text(self.target, chance, messages)
        return await attack_agent(self.target, chance, messages)

    async def send_datagrams(self, chance: random.Random, datagrams: int) -> int:
        """Sends mutated datagrams of drone 2's link, from its own address and from another."""
        agent = self.agents[1]
        fuzzer = DatagramFuzzer(chance, sender=agent._sealed, urgent=_PROGRESS, epoch=lambda: 0, fenced=False)
        place = agent._socket.getpeername()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as elsewhere:
            elsewhere.setblocking(False)
            sent = 0
            for number in range(datagrams):
                datagram = fuzzer.next().datagram
                with contextlib.suppress(OSError):
                    if chance.random() < 0.5:
                        agent._socket.send(datagram)
                    else:
                        elsewhere.sendto(datagram, place)
                    sent += 1
                if number % 16 == 0:
                    await asyncio.sleep(0.002)
        agent.keep_alive()
        await asyncio.sleep(1.0)
        return sent


@contextlib.asynccontextmanager
async def fuzzed_tower(folder: Path) -> AsyncIterator[FuzzedTower]:
    """Runs until the block ends."""
    async with (
        load_tower(folder / "tower", drones=2 + _AS_AGENTS, settings=_WITHOUT_FLOOD_GATE) as tower,
        httpx.AsyncClient(base_url=tower.url, headers={"Cookie": tower.cookie}, trust_env=False, timeout=30) as http,
    ):
        agents = await sign_in_all(tower.url, tower.keys[:2])
        async with kept_alive(agents):
            answer = await http.post("/api/v1/drones/1/control/acquire", json={"reason": "fuzz"})
            answer.raise_for_status()
            witness = Witness(await tower.browser(), agents[0])
            witness.start()
            target = Target(tower.url, tower.cookie, (1, 2), tuple(tower.keys[2:]))
            try:
                yield FuzzedTower(tower, target, witness, agents, folder / "tower" / "tower.log", http)
            finally:
                await witness.stop()
