"""A real PX4 that simulates its own quadcopter (SIH), on an isolated loopback.

    async with flying_px4(build, folder) as autopilot:
        autopilot.port      # its link for an onboard computer: the agent's side
        autopilot.station   # its link for a ground station, for the test's own queries

`build` is the folder of a SITL build, with `bin/px4` and `etc/`, from any source. It flies in real time. It keeps a
lock for its number in the machine's temporary folder, so one flies at a time.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import sys
from collections.abc import AsyncIterator, Mapping
from pathlib import Path
from typing import Any, Final

from bench.closed_loopback import REFUSED, SOCKETS
from bench.real_autopilot import NoAutopilot
from bench.rig import CHECKOUT, HOME, wait_for
from wire.dialect import build as built
from wire.dialect import decode, mavlink
from wire.frames import MalformedFrame, source, split_frames

ONBOARD_PORT: Final = 14540
STATION_PORT: Final = 14550
"""The port to which PX4's start-up script sends."""
BOOT_S: Final = 60.0
STATION: Final = 200
"""A system id that is nobody's ground station."""
HEARTBEAT_S: Final = 1.0


class Station:
    """The newest message of each kind on PX4's link for a ground station, and requests to it.

    Sends heartbeats while `is_present`: PX4 sends STATUSTEXT only on a link with a ground station. But then PX4 does
    not notice that the people behind its other link are gone.
    """

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        self._loop = asyncio.get_running_loop()
        self._address: tuple[str, int] | None = None
        self._sequence = 0
        self.newest: dict[str, Any] = {}
        self.texts: list[str] = []
        self.acks: list[tuple[int, int]] = []
        self.is_present = False
        self._loop.add_reader(sock, self._read)
        self._beating = asyncio.create_task(self._beat())

    async def _beat(self) -> None:
        gcs, none = mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID
        while True:
            if self.is_present:
                self.send(mavlink.MAVLink_heartbeat_message(gcs, none, 0, 0, mavlink.MAV_STATE_ACTIVE, 3))
            await asyncio.sleep(HEARTBEAT_S)

    def send(self, message: Any) -> None:
        if self._address is not None:
            self._sequence += 1
            frame = built(message, system_id=STATION, component_id=1, sequence=self._sequence)
            self._sock.sendto(frame, self._address)

    async def ask(self, number: int, *params: float, within_s: float = 3.0) -> int:
        """Returns the MAV_RESULT of a command. Raises TimeoutError."""
        count = len(self.acks)
        seven = (*params, *(0.0,) * (7 - len(params)))
        self.send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *seven))
        await wait_for(f"the answer to {number}", lambda: any(a[0] == number for a in self.acks[count:]), within_s)
        return next(result for command, result in self.acks[count:] if command == number)

    @property
    def healthy(self) -> bool:
        """Whether it reports that it could arm."""
        status = self.newest.get("SYS_STATUS")
        bit = mavlink.MAV_SYS_STATUS_PREARM_CHECK
        return status is not None and bool(status.onboard_control_sensors_health & bit)

    async def close(self) -> None:
        self._beating.cancel()
        await asyncio.gather(self._beating, return_exceptions=True)
        self._loop.remove_reader(self._sock)
        self._sock.close()

    def _read(self) -> None:
        while True:
            try:
                data, self._address = self._sock.recvfrom(4096)
            except (BlockingIOError, ConnectionError):
                return
            with contextlib.suppress(MalformedFrame):
                for frame in split_frames(data):
                    if source(frame) == (1, 1):
                        self._note(decode(frame))

    def _note(self, message: Any) -> None:
        if message is None:
            return
        kind = message.get_type()
        self.newest[kind] = message
        if kind == "STATUSTEXT":
            self.texts.append(message.text)
        elif kind == "COMMAND_ACK":
            self.acks.append((message.command, message.result))


class RealPx4:
    """One PX4 process. `port` and `station` exist after `start`."""

    def __init__(
        self,
        build: Path,
        folder: Path,
        *,
        parameters: Mapping[str, float] | None = None,
        home: tuple[float, float, float] = HOME,
    ) -> None:
        """Sets `parameters` before start-up. `folder`: used by this process alone. `home`: degrees, metres above sea
        level."""
        self.port: socket.socket
        self.station: Station
        self._build = build.resolve()
        self._folder = folder
        self._parameters = dict(parameters or {})
        self._home = home
        self._process: asyncio.subprocess.Process | None = None

    async def start(self) -> None:
        """Starts it and waits until it could arm. Raises NoAutopilot."""
        self._folder.mkdir(parents=True, exist_ok=True)
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        ports = f"{ONBOARD_PORT},{STATION_PORT},0"
        command = [str(self._build / "bin" / "px4"), "-d", str(self._build / "etc"), "-w", str(self._folder)]
        with ours, theirs, (self._folder / "autopilot.log").open("ab") as log:
            self._process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-m", "bench.closed_loopback", f"{theirs.fileno()}:{ports}", *command),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                pass_fds=[theirs.fileno()],
                cwd=self._folder,
                env=self._environment(),
            )
            theirs.close()
            words, descriptors, _, _ = await asyncio.to_thread(socket.recv_fds, ours, 256, SOCKETS)
        sockets = [socket.socket(fileno=descriptor) for descriptor in descriptors]
        if len(sockets) != SOCKETS:
            raise NoAutopilot(f"no network of its own for PX4: {words.removeprefix(REFUSED).decode()}")
        for one in sockets:
            one.setblocking(False)
        self.port, station, unused = sockets
        unused.close()
        self.station = Station(station)
        try:
            await wait_for("PX4 to be ready to arm", self._ready, BOOT_S)
        except TimeoutError as error:
            raise NoAutopilot(f"{error}; it said: {self.station.texts[-3:]}") from None

    def _environment(self) -> dict[str, str]:
        lat_deg, lon_deg, alt_m = self._home
        ours = {f"PX4_PARAM_{name}": f"{value:g}" for name, value in self._parameters.items()}
        return {
            "PYTHONPATH": str(CHECKOUT),
            "HOME": str(self._folder),
            "PATH": f"{self._build / 'bin'}:/usr/bin:/bin",
            "PX4_SIM_MODEL": "sihsim_quadx",
            "PX4_HOME_LAT": f"{lat_deg:.7f}",
            "PX4_HOME_LON": f"{lon_deg:.7f}",
            "PX4_HOME_ALT": f"{alt_m:.2f}",
            **ours,
        }

    def _ready(self) -> bool:
        if self._process is not None and self._process.returncode is not None:
            log = (self._folder / "autopilot.log").read_text(errors="replace")
            raise NoAutopilot(f"PX4 ended: {log[-500:]}")
        return self.station.healthy

    async def stop(self) -> None:
        if self._process is not None and self._process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()
        if hasattr(self, "station"):
            await self.station.close()
            self.port.close()


@contextlib.asynccontextmanager
async def flying_px4(build: Path, folder: Path, **options: Any) -> AsyncIterator[RealPx4]:
    """`options`: as for RealPx4."""
    autopilot = RealPx4(build, folder, **options)
    try:
        await autopilot.start()
        yield autopilot
    finally:
        await asyncio.shield(autopilot.stop())


class Cable:
    """Connects PX4's link for an onboard computer to the UDP port of an agent on our loopback. Passes everything."""

    def __init__(self, autopilot: RealPx4, agent_port: int) -> None:
        self._inner = autopilot.port
        self._agent = ("127.0.0.1", agent_port)
        self._autopilot: tuple[str, int] | None = None
        self._loop = asyncio.get_running_loop()
        self._outer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._outer.setblocking(False)
        self._outer.bind(("127.0.0.1", 0))
        self._loop.add_reader(self._inner, self._down)
        self._loop.add_reader(self._outer, self._up)

    def _down(self) -> None:
        with contextlib.suppress(BlockingIOError, ConnectionError):
            while True:
                data, self._autopilot = self._inner.recvfrom(4096)
                self._outer.sendto(data, self._agent)

    def _up(self) -> None:
        with contextlib.suppress(BlockingIOError, ConnectionError):
            while True:
                data = self._outer.recv(4096)
                if self._autopilot is not None:
                    self._inner.sendto(data, self._autopilot)

    def cut(self) -> None:
        self._loop.remove_reader(self._inner)
        self._loop.remove_reader(self._outer)
        self._outer.close()
