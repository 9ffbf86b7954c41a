"""A tower, an agent and a simulator as real processes, with a tap between the last two; on loopback or on a network.

On the emulated network tower and users are one host, the drone (agent, tap, simulator) is the other.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import socket
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bench.link_model import Profile
from bench.namespaces import Network
from bench.person import Person
from bench.tap import ADMIN, OPERATOR, Tap
from bench.tls_front import TlsFront, make_certificate

BIN: Final = Path(sys.executable).parent
CHECKOUT: Final = Path(__file__).resolve().parent.parent
PASSWORD: Final = "correct horse battery"
SLOW: Final = Profile(delay_s=0.15, loss=0.05)
"""The drone's access link, each way: 300 ms round trip, and 5 % of the packets lost in either direction."""
HOME: Final = (47.3977, 8.5456, 488.0)
START_S: Final = 120.0


@dataclass(frozen=True, slots=True)
class Kind:
    """The vehicle."""

    flavour: str
    radio: bool

    @property
    def name(self) -> str:
        return f"{self.flavour}, {'radio' if self.radio else 'no radio'}"

    @property
    def options(self) -> list[str]:
        words = ["--flavour", self.flavour, "--radio", "low" if self.radio else "none", "--boot-s", "3"]
        if self.flavour == "px4" and self.radio:
            words += ["--param", "COM_RC_IN_MODE=1"]  # else the receiver, which comes first, excludes all other sources
        return words


class Rig:
    def __init__(self, folder: Path, kind: Kind, network: Network | None) -> None:
        self._folder, self.kind, self._network = folder, kind, network
        self._processes: list[asyncio.subprocess.Process] = []
        self._port = 0
        self._udp_port = 0
        self._starts = 0
        self._front: TlsFront | None = None
        self._trust: Path | None = None
        self.public_address: str | None = None
        """The tower's address for other hosts; None on loopback."""
        self.tower: asyncio.subprocess.Process
        self.agent: asyncio.subprocess.Process
        self.tap: Tap
        self.admin: Person
        self.operator: Person

    @property
    def has_line(self) -> bool:
        """Whether there is a line between tower and drone that can be cut."""
        return self._network is not None

    async def change_line(self, profile: Profile) -> None:
        assert self._network is not None
        await self._network.change("drone", profile)

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self._port}"

    async def start(self) -> None:
        await self._tower_command("migrate")
        for name, role in (("admin", "admin"), ("operator", "operator")):
            await self._tower_command(
                "user", "add", name, "--role", role, "--password-stdin", "--for-good", stdin=PASSWORD
            )
        token = str(self._folder / "drone.token")
        await self._tower_command("drone", "add", "Kestrel", "--owner", "operator", "--token-file", token)
        await self.start_tower()
        for_agent = self.address
        if self._network is not None:
            address = self._network.address("tower")
            self._trust, key = make_certificate(self._folder, address)
            self._front = TlsFront(self._port)
            for_agent = f"https://{address}:{await self._front.open(address, self._trust, key)}"
            self.public_address = for_agent
        await self._start_drone(for_agent, token)
        self.admin = Person("admin", ADMIN, self.address, 1)
        self.operator = Person("operator", OPERATOR, self.address, 1)
        for person in (self.admin, self.operator):
            await person.sign_in(PASSWORD)
            await person.go_live()

        async def online() -> bool:
            drone = await self.admin.drone()
            return bool(drone["online"] and drone["autopilot_heard"])

        await wait_for("the drone to be online", online)

    async def _start_drone(self, tower: str, token: str) -> None:
        """Starts simulator, tap and agent. `tower`: its address from the drone; `token`: the file of its credential."""
        with self._at_the_drone():
            agent_port = free_udp_port()
            self.tap = Tap(("127.0.0.1", agent_port))
            self.tap.open()
        self.agent = await self._run(
            "agent",
            *self._drone_command(
                "tower-agent",
                "run",
                "--tower",
                tower,
                "--token",
                token,
                "--autopilot",
                f"udpin:127.0.0.1:{agent_port}",
            ),
        )
        home = ",".join(str(number) for number in HOME)
        out = f"udp:127.0.0.1:{self.tap.port}"
        await self._run(
            "simulator", *self._drone_command("tower-sim", "--home", f"{home},0", "--out", out, *self.kind.options)
        )

    async def start_tower(self) -> None:
        """Also restarts it after a kill, on the same ports."""
        self._starts += 1
        name = f"tower-{self._starts}"
        self.tower = await self._run(name, str(BIN / "tower"), "serve")
        log = self._folder / f"{name}.log"

        async def listening() -> bool:
            found = re.search(r"http://[\d.]+:(\d+)", log.read_text(errors="replace"))
            if found:
                self._port = int(found[1])
            if self.tower.returncode is not None:
                raise RuntimeError(log.read_text(errors="replace")[-2000:])
            return found is not None

        await wait_for("the tower to listen", listening)

    @property
    def _environment(self) -> dict[str, str]:
        more = {
            "TOWER_VAR": str(self._folder),
            "TOWER_AGENT_STATE": str(self._folder / "agents"),
            "TOWER_HOST": "127.0.0.1",
            "TOWER_PORT": str(self._port),
            "TOWER_UDP_HOST": "0.0.0.0" if self._network is not None else "127.0.0.1",
            "TOWER_UDP_PORT": str(self._fixed_udp_port()),
            "TOWER_ARGON2_MEMORY_KIB": "19456",
            "TOWER_ARGON2_ROUNDS": "2",
        }
        if self._trust is not None:
            more["SSL_CERT_FILE"] = str(self._trust)
        return {**os.environ, **more}

    def _fixed_udp_port(self) -> int:
        self._udp_port = self._udp_port or free_udp_port()
        return self._udp_port

    def _drone_command(self, program: str, *words: str) -> list[str]:
        command = [str(BIN / program), *words]
        return command if self._network is None else self._network.command_in("drone", *command)

    @contextlib.contextmanager
    def _at_the_drone(self) -> Iterator[None]:
        if self._network is None:
            yield
        else:
            with self._network.inside("drone"):
                yield

    async def _tower_command(self, *words: str, stdin: str = "") -> None:
        process = await asyncio.create_subprocess_exec(
            str(BIN / "tower"),
            *words,
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            env=self._environment,
            cwd=CHECKOUT,
        )
        said, _ = await process.communicate(stdin.encode())
        if process.returncode:
            raise RuntimeError(f"tower {words[0]}: {said.decode()}")

    async def _run(self, name: str, *command: str) -> asyncio.subprocess.Process:
        with (self._folder / f"{name}.log").open("ab") as log:
            process = await asyncio.create_subprocess_exec(
                *command,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env=self._environment,
                cwd=CHECKOUT,
            )
        self._processes.append(process)
        return process

    async def stop(self) -> None:
        for name in ("operator", "admin"):
            person = getattr(self, name, None)
            if person is not None:
                await person.close()
        for process in reversed(self._processes):
            if process.returncode is None:
                with contextlib.suppress(ProcessLookupError):
                    process.terminate()
                try:
                    await asyncio.wait_for(process.wait(), 5)
                except TimeoutError:
                    process.kill()
                    await process.wait()
        if self._front is not None:
            await self._front.close()
        if hasattr(self, "tap"):
            self.tap.close()


@contextlib.asynccontextmanager
async def running(folder: Path, kind: Kind, network: Network | None) -> AsyncIterator[Rig]:
    folder.mkdir(parents=True)  # noqa: ASYNC240 (once, before anything runs)
    rig = Rig(folder, kind, network)
    try:
        await rig.start()
        yield rig
    finally:
        await asyncio.shield(rig.stop())


async def wait_for(what: str, look: Callable[[], object], timeout_s: float = START_S) -> None:
    """Waits until `look` (a plain or an async function) returns true. Raises TimeoutError with the awaited
    condition."""
    deadline = asyncio.get_running_loop().time() + timeout_s
    while True:
        answer = look()
        if asyncio.iscoroutine(answer):
            answer = await answer
        if answer:
            return
        if asyncio.get_running_loop().time() > deadline:
            raise TimeoutError(f"waited {timeout_s:g} s in vain for {what}")
        await asyncio.sleep(0.02)


def free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
