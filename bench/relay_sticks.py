"""How long a stick takes from the browser's socket to the autopilot's: a tower under load, a real agent, a stub."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import sys
import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Final

from bench.lean_browser import LeanBrowser
from bench.load_agents import Telemetry, fly, kept_alive, sign_in_all
from bench.load_frames import EVENT_KINDS
from bench.load_tower import end, load_tower
from bench.pilot_sticks import STICKS_S, answer_ping, stick, stick_number, take
from bench.precise_timer import PreciseTimer
from bench.relay_systems import under_test
from wire.dialect import build, mavlink
from wire.frames import frame_length
from wire.ids import DroneId

AGENT: Final = Path(sys.executable).parent / "tower-agent"


class StubAutopilot:
    """Sends a heartbeat every second, and records when each stick arrived: `buttons` is its number."""

    def __init__(self, agent_port: int) -> None:
        self.arrived: dict[int, float] = {}
        self.agent_pid = 0
        self.is_armed = False
        self._agent = ("127.0.0.1", agent_port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind(("127.0.0.1", 0))
        asyncio.get_running_loop().add_reader(self._socket, self._receive)
        self._beating = asyncio.create_task(self._beat())

    async def _beat(self) -> None:
        sequence = 0
        while True:
            sequence += 1
            base_mode = 81 | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if self.is_armed else 0)
            message = mavlink.MAVLink_heartbeat_message(2, 3, base_mode, 2, 4, 3)
            self._socket.sendto(build(message, system_id=1, component_id=1, sequence=sequence), self._agent)
            await asyncio.sleep(1.0)

    def _receive(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                datagram = self._socket.recv(2048)
                now, at = time.monotonic(), 0
                while at < len(datagram):
                    after = at + frame_length(datagram, at)
                    frame = datagram[at:after]
                    number = stick_number(frame)
                    if number is not None:
                        self.arrived.setdefault(number, now)
                    at = after

    def close(self) -> None:
        self._beating.cancel()
        asyncio.get_running_loop().remove_reader(self._socket)
        self._socket.close()


async def stick_latencies_ms(
    folder: Path, *, drones: int, frames_per_s: float, for_s: float
) -> tuple[int, list[float]]:
    """Returns (number of sticks sent, milliseconds of each that arrived). The admin flies the last drone through a real
    agent; the others are load."""
    async with load_tower(folder, drones=drones + 1, cpus=under_test()) as tower:
        agents = await sign_in_all(tower.url, tower.keys[:-1])
        async with kept_alive(agents), real_agent(folder, tower.url, tower.keys[-1]) as autopilot:
            browser = await tower.browser()
            browser.on_text = lambda text: answer_ping(browser, text)
            await take(tower, drones + 1)
            telemetry = Telemetry(frames_per_s / drones, EVENT_KINDS)
            flying = asyncio.create_task(fly(agents, telemetry, for_s=for_s + 1.0))
            sent = await _send_sticks(browser, DroneId(drones + 1), for_s)
            await flying
    took = [(autopilot.arrived[number] - at) * 1e3 for number, at in sent.items() if number in autopilot.arrived]
    return len(sent), took


async def _send_sticks(browser: LeanBrowser, drone_id: DroneId, for_s: float) -> dict[int, float]:
    timer = PreciseTimer()
    sent: dict[int, float] = {}
    begin = time.monotonic() + 0.5
    try:
        for number in range(1, round(for_s / STICKS_S) + 1):
            await timer.until(begin + number * STICKS_S)
            sent[number] = time.monotonic()
            browser.send_binary(stick(drone_id, number))
        await asyncio.sleep(0.5)
    finally:
        timer.close()
    return sent


@contextlib.asynccontextmanager
async def real_agent(
    folder: Path, tower_url: str, key: str, made: Callable[[int], StubAutopilot] = StubAutopilot
) -> AsyncIterator[StubAutopilot]:
    """Runs an agent process for the drone with this key, with an autopilot that `made` creates for a port."""
    token = folder / "drone.token"
    token.touch(mode=0o600)
    token.write_text(key)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    words = [str(AGENT), "run", "--tower", tower_url, "--token", str(token), "--autopilot", f"udpin:127.0.0.1:{port}"]
    words += ["--state", str(folder / "state")]
    with (folder / "agent.log").open("wb") as log:
        process = await asyncio.create_subprocess_exec(*words, stdin=asyncio.subprocess.DEVNULL, stdout=log, stderr=log)
    autopilot = made(port)
    autopilot.agent_pid = process.pid
    try:
        yield autopilot
    finally:
        autopilot.close()
        await end(process)
