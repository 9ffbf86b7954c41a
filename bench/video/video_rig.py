"""For `bench video`: tower, agent and simulator as in the field; the agent has the simulator's camera, which flies.

The camera is MJPEG over HTTP on the drone's host; the peer's ffmpeg reads the same one there.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Final

from bench.namespaces import Network
from bench.process_cost import cpu_us
from bench.rig import HOME, Rig, free_udp_port, wait_for
from bench.video.orbiting import CARRIER, OrbitPilot
from bench.video.settings import Setting

STOPS_WITHIN_S: Final = 20.0


class VideoRig(Rig):
    """A Rig without a tap whose drone has a camera."""

    def __init__(self, folder: Path, network: Network | None, setting: Setting) -> None:
        super().__init__(folder, CARRIER, network)
        self._setting = setting
        self._camera_port = 0
        self._pilot: OrbitPilot | None = None

    @property
    def camera(self) -> str:
        """The camera's address on the drone's host."""
        wanted = f"width={self._setting.width}&height={self._setting.height}&rate={self._setting.rate_hz:g}"
        return f"http://127.0.0.1:{self._camera_port}/camera?{wanted}"

    @property
    def viewers_address(self) -> str:
        """The tower's address for a browser on any host."""
        return self.address if self.public_address is None else self.public_address

    @property
    def towers_address(self) -> str:
        """Of the tower's host, for others."""
        return "127.0.0.1" if self._network is None else self._network.address("tower")

    def command_at(self, host: str, *command: str) -> list[str]:
        return list(command) if self._network is None else self._network.command_in(host, *command)

    async def _start_drone(self, tower: str, token: str) -> None:
        with self._at_the_drone():
            agent_port, nobodys_camera = free_udp_port(), free_tcp_port()
        await self._start_camera("--out", f"udp:127.0.0.1:{agent_port}", "--camera", str(nobodys_camera))
        await self._start_agent(tower, token, f"udpin:127.0.0.1:{agent_port}")

    async def _start_camera(self, *first: str) -> None:
        """Starts the simulator; `first`: options for the agent's vehicle. The last vehicle has the camera."""
        with self._at_the_drone():
            self._camera_port = free_tcp_port()
            self._pilot = pilot = OrbitPilot()
        home = ",".join(str(number) for number in HOME)
        words = [*first, "--out", f"udp:127.0.0.1:{pilot.port}", "--camera", str(self._camera_port)]
        count = str(words.count("--out"))
        words = ["--home", f"{home},0", "--count", count, *words, *CARRIER.options]
        await self._run("simulator", *self._drone_command("tower-sim", *words))
        await wait_for("the simulator's camera", self._camera_answers, 60)
        await wait_for("the camera to fly", lambda: pilot.circles, 90)

    async def _start_agent(self, tower: str, token: str, autopilot: str) -> None:
        words = ("--tower", tower, "--token", token, "--autopilot", autopilot, "--camera", self.camera)
        self.agent = await self._run("agent", *self._drone_command("tower-agent", "run", *words))

    def _camera_answers(self) -> bool:
        with self._at_the_drone(), socket.socket() as knocking:
            knocking.settimeout(1)
            return knocking.connect_ex(("127.0.0.1", self._camera_port)) == 0

    async def stop(self) -> None:
        if self._pilot is not None:
            self._pilot.close()
        await super().stop()

    def video_pids(self) -> list[int]:
        """Of the agent's video process, if there is one."""
        return _children(self.agent.pid)

    async def until_idle(self) -> None:
        """Waits until the agent has stopped encoding, so that it does not run beside the peer."""
        still = 0

        async def idle() -> bool:
            nonlocal still
            before = {pid: _cpu_or_nothing(pid) for pid in self.video_pids()}
            await asyncio.sleep(0.5)
            busy = any(_cpu_or_nothing(pid) - used > 10_000 for pid, used in before.items())
            still = 0 if busy else still + 1
            return still >= 2

        await wait_for("the agent to stop its video", idle, STOPS_WITHIN_S)


@contextlib.asynccontextmanager
async def video_running(
    folder: Path, network: Network | None, setting: Setting, kind: type[VideoRig] = VideoRig
) -> AsyncIterator[VideoRig]:
    folder.mkdir(parents=True)  # noqa: ASYNC240 (once, before anything runs)
    rig = kind(folder, network, setting)
    try:
        await rig.start()
        yield rig
    finally:
        await asyncio.shield(rig.stop())


class Meter:
    """What processes use between `begin` and `end`."""

    def __init__(self, pids: dict[str, list[int]]) -> None:
        self._pids = pids
        self._before = self._now()

    def _now(self) -> dict[str, float]:
        return {name: sum(_cpu_or_nothing(pid) for pid in pids) for name, pids in self._pids.items()}

    def used_ms(self) -> dict[str, float]:
        """Milliseconds of processor since the beginning."""
        return {name: (used - self._before[name]) / 1000 for name, used in self._now().items()}


def _cpu_or_nothing(pid: int) -> float:
    try:
        return cpu_us(pid)
    except OSError:
        return 0.0


def _children(pid: int) -> list[int]:
    with contextlib.suppress(OSError):
        return [int(word) for file in _tasks(pid) for word in file.read_text().split()]
    return []


def _tasks(pid: int) -> Iterator[Path]:
    return Path(f"/proc/{pid}/task").glob("*/children")


def free_tcp_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
