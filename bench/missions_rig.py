"""For `bench missions`: tower, agent and simulator as in the field, beside MAVSDK on the same line.

The simulator flies two vehicles on the drone's host: one is connected to the agent there, the other over the line to
MAVSDK on the tower's host, as a ground station without a tower would be. Or they are two real ArduCopters.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import ssl
import time
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import httpx

from bench.autopilot_tap import AutopilotTap
from bench.ground_station import GroundStation
from bench.namespaces import Network
from bench.peers.mavsdk_server import Installed, MavSdk, mavsdk_on
from bench.real_autopilot import RealAutopilot, Receiver
from bench.rig import BIN, HOME, PASSWORD, Kind, Rig, free_udp_port

COPTER: Final = Kind("ardupilot", radio=True)
DRONE: Final = "/drones/1"
REQUEST_WITHIN_S: Final = 180.0
KEPT_S: Final = 2.0
"""The tower closes idle connections after five."""


@dataclass(frozen=True, slots=True)
class Answered:
    """A response, and how long the user waited for it."""

    status: int
    json: Any
    took_s: float


class RestPerson:
    """The operator's program on one host: plain requests on a persistent connection, as in a browser."""

    def __init__(self, address: str, trust: Path | None, enter: Callable[[], AbstractContextManager[None]]) -> None:
        """`enter`: within it, what a thread opens belongs to the host."""
        self._enter = enter
        # A separate thread, because a thread belongs to a host as long as it opens something there.
        self._thread = ThreadPoolExecutor(max_workers=1)
        verify: ssl.SSLContext | bool = True if trust is None else ssl.create_default_context(cafile=str(trust))
        self._http = httpx.Client(
            base_url=f"{address}/api/v1",
            timeout=REQUEST_WITHIN_S,
            verify=verify,
            trust_env=False,
            limits=httpx.Limits(keepalive_expiry=KEPT_S),
        )

    async def sign_in(self, name: str) -> None:
        answered = await self.ask("POST", "/session", {"name": name, "password": PASSWORD})
        assert answered.status == 200, answered.json

    async def ask(self, method: str, path: str, body: Any = None) -> Answered:
        return await asyncio.get_running_loop().run_in_executor(self._thread, self._ask, method, path, body)

    def _ask(self, method: str, path: str, body: Any) -> Answered:
        with self._enter():
            began = time.monotonic()
            answer = self._http.request(method, path, json=body)
            took_s = time.monotonic() - began
        return Answered(answer.status_code, answer.json() if answer.content else None, took_s)

    async def close(self) -> None:
        await asyncio.get_running_loop().run_in_executor(self._thread, self._http.close)
        self._thread.shutdown()


class MissionsRig(Rig):
    """A Rig without a tap, whose simulator flies another vehicle for MAVSDK."""

    def __init__(
        self, folder: Path, network: Network | None, autopilot: Path | None = None, *, payloads: bool = False
    ) -> None:
        """`autopilot`: the program of a real ArduCopter's simulator, in place of ours. `payloads`: ours has a camera, a
        gimbal, and metadata of its parameters."""
        super().__init__(folder, COPTER, network)
        self._autopilot = autopilot
        self.has_payloads = payloads and autopilot is None
        self._real: list[RealAutopilot] = []
        self._taps: list[AutopilotTap] = []
        self._ground_port = free_udp_port()
        self._persons: list[RestPerson] = []

    async def _start_drone(self, tower: str, token: str) -> None:
        with self._at_the_drone():
            agent_port = free_udp_port()
        at = f"127.0.0.1:{agent_port}"
        words = ("--tower", tower, "--token", token, "--autopilot", f"udpin:{at}")
        self.agent = await self._run("agent", *self._drone_command("tower-agent", "run", *words))
        ground = "127.0.0.1" if self._network is None else self._network.address("tower")
        if self._autopilot is not None:
            await self._start_real(("127.0.0.1", agent_port), "127.0.0.1")
            drone = "127.0.0.1" if self._network is None else self._network.address("drone")
            await self._start_real((ground, self._ground_port), drone)
            return
        home = ",".join(str(number) for number in HOME)
        outs = ("--out", f"udp:{at}", "--out", f"udp:{ground}:{self._ground_port}")
        payloads = ("--camera-component", "--gimbal", "--metadata") if self.has_payloads else ()
        flown = ("--home", f"{home},0", "--count", "2", *outs, *payloads, *self.kind.options)
        await self._run("simulator", *self._drone_command("tower-sim", *flown))

    async def _start_real(self, other_end: tuple[str, int], bound_to: str) -> None:
        assert self._autopilot is not None
        real = RealAutopilot(self._autopilot, self._folder / f"autopilot-{len(self._real)}", receiver=Receiver.LOW)
        self._real.append(real)
        await real.start()
        tap = AutopilotTap(other_end, real, bound_to=bound_to)
        self._taps.append(tap)
        with self._at_the_drone():
            tap.open()

    async def near(self) -> RestPerson:
        """Returns the operator on the tower's own host, signed in."""
        return await self._signed_in(RestPerson(self.address, None, lambda: self.in_host("tower")))

    async def far(self) -> RestPerson:
        """Returns the operator on a separate host, signed in. Only on a network."""
        assert self._network is not None and self.public_address is not None
        return await self._signed_in(RestPerson(self.public_address, self._trust, lambda: self.in_host("browser")))

    def in_host(self, host: str) -> AbstractContextManager[None]:
        """What the thread opens within it belongs to that host; loopback has only one."""
        return nullcontext() if self._network is None else self._network.inside(host)

    async def _signed_in(self, person: RestPerson) -> RestPerson:
        self._persons.append(person)
        await person.sign_in("operator")
        return person

    @contextlib.asynccontextmanager
    async def mavsdk(self, installed: Installed) -> AsyncIterator[MavSdk]:
        """Starts a new server, and connects it with the other vehicle. Raises PeerFailed."""
        async with mavsdk_on(installed, self._ground_port, _free_tcp_port(), self._folder / "mavsdk.log") as peer:
            yield peer

    async def ground_station(self) -> GroundStation:
        """Starts an operator's program at `tower connect` on the tower's host."""
        token = self._folder / "station.token"
        scopes = ("--scope", "watch", "--scope", "fly")
        await self._tower_command("token", "add", "operator", "station", *scopes, "--token-file", str(token))
        where = ("--tower", self.address, "--token-file", str(token), "--fly", "--tcp", "127.0.0.1:0")
        await self._run("connect", str(BIN / "tower"), "connect", "kestrel", *where)
        return await GroundStation.at(self._folder / "connect.log")

    async def stop(self) -> None:
        for person in self._persons:
            await person.close()
        await super().stop()
        for tap in self._taps:
            tap.close()
        for real in self._real:
            await real.stop()


async def connect_time_s(rig: MissionsRig) -> float:
    """Returns TCP's connection time from the drone's host to the tower's: a round trip, or a second more after a
    loss."""
    assert rig.public_address is not None
    url = httpx.URL(rig.public_address)

    def knock() -> float:
        with rig.in_host("drone"), socket.socket() as knocking:
            began = time.monotonic()
            knocking.connect((url.host, url.port or 443))
            return time.monotonic() - began

    return await asyncio.to_thread(knock)


def _free_tcp_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
