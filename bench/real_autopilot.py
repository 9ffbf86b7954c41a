"""A real ArduPilot, given as a path to its own simulator's program, on a loopback that nobody else can reach.

    async with flying(binary, folder, receiver=Receiver.NONE) as autopilot:
        autopilot.port      # a socket of its network: the agent's side of SERIAL0 (bench.autopilot_tap)
        autopilot.truth     # SERIAL1: its true motion, only for the measurement

It listens for its radio receiver on every address, and no option changes that; hence the closed loopback. It boots
quickly and flies at speed 1. This module does not know where the program comes from.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
import sys
from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from bench.closed_loopback import REFUSED, SOCKETS
from bench.rig import CHECKOUT, HOME, wait_for
from bench.truth import Truth

BOOT_SPEED: Final = 8
BOOT_S: Final = 120.0
TCP_PORT: Final = 5760
FEED_S: Final = 0.02
FED_FOR_S: Final = 15.0
"""It keeps the last values, so the feed ends when they have certainly arrived."""

_CALIBRATED: Final = {
    **{
        f"COMPASS_OFS{number}_{axis}": value
        for number in ("", 2, 3)
        for axis, value in zip("XYZ", (5, 13, -18), strict=True)
    },
    **{f"INS_ACC{number}OFFS_{axis}": 0.001 for number in ("", 2) for axis in "XYZ"},
    **{f"INS_ACC{number}SCAL_{axis}": 1.001 for number in ("", 2) for axis in "XYZ"},
}
"""Without offsets it considers its sensors uncalibrated and does not arm."""

_AIRFRAME: Final = {
    "FRAME_CLASS": 1,
    "FRAME_TYPE": 0,
    "MOT_THST_EXPO": 0.65,
    "MOT_THST_HOVER": 0.39,
    "MOT_BAT_VOLT_MIN": 9.6,
    "MOT_BAT_VOLT_MAX": 12.8,
    "BATT_MONITOR": 4,
    "ATC_RAT_YAW_P": 0.3,
    "ATC_RAT_YAW_I": 0.02,
    "SIM_BARO_RND": 0,
    "FS_THR_ENABLE": 1,
    **{
        f"RC{channel}_{end}": value
        for channel in range(1, 9)
        for end, value in (("MIN", 1000), ("MAX", 2000), ("TRIM", 1500))
    },
    **{f"FLTMODE{position}": 0 for position in range(1, 7)},
}
"""A quadcopter with a radio whose mode switch selects STABILIZE in every position. All else is ArduCopter's default."""


@dataclass(frozen=True, slots=True)
class Airframe:
    """What the simulator flies or drives. `model`: the simulator's name for it. `files`: of parameters, which
    `parameters` override."""

    model: str
    parameters: Mapping[str, float]
    files: tuple[Path, ...] = ()


QUADCOPTER: Final = Airframe("+", _AIRFRAME)


class Receiver(StrEnum):
    """The radio receiver's output while nobody touches the transmitter."""

    LOW = "low"
    """Throttle at 1000, the other sticks centred."""
    CENTRED = "centred"
    NONE = "none"
    """No receiver."""


_CHANNELS: Final = {
    Receiver.LOW: (1500, 1500, 1000, 1500, 1800, 1000, 1000, 1800),
    Receiver.CENTRED: (1500, 1500, 1500, 1500, 1800, 1000, 1000, 1800),
}


class NoAutopilot(RuntimeError):
    """The autopilot cannot run on this machine, or did not start."""


class RealAutopilot:
    """One process. `port` and `truth` exist after `start`."""

    def __init__(
        self,
        binary: Path,
        folder: Path,
        *,
        receiver: Receiver,
        parameters: Mapping[str, float] | None = None,
        home: tuple[float, float, float] = HOME,
        on_tcp: bool = False,
        agent_on_second: bool = False,
        airframe: Airframe = QUADCOPTER,
    ) -> None:
        """`parameters` are set in addition to the defaults here; `folder` is used by it alone. `home`: degrees, metres
        above sea level.

        `on_tcp`: SERIAL0 listens at TCP_PORT of its network (`namespace`), and `port` receives nothing.
        `agent_on_second`: the agent's port is SERIAL1, and the measurement's SERIAL0, which takes unsigned frames too.
        """
        self._on_tcp = on_tcp
        self._agent_on_second = agent_on_second
        self.receiver = receiver
        self.port: socket.socket
        self.truth: Truth
        self._home = home
        self._binary = binary.resolve()
        self._folder = folder
        self._airframe = airframe
        self._parameters = {**_CALIBRATED, **airframe.parameters, **(parameters or {})}
        self._process: asyncio.subprocess.Process | None = None
        self._radio: socket.socket | None = None
        self._feeding: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Waits until it is ready to arm. Raises NoAutopilot."""
        self._folder.mkdir(parents=True, exist_ok=True)
        wanted = {**self._parameters, "SIM_RC_FAIL": float(self.receiver is Receiver.NONE)}
        ours = self._folder / "parameters.parm"
        ours.write_text("".join(f"{name} {value:g}\n" for name, value in wanted.items()))
        home = ",".join(f"{number:.10g}" for number in (*self._home, 0.0))
        first = f"tcp:{TCP_PORT}" if self._on_tcp else "udpclient:127.0.0.1:{port0}"
        ports = [first, "udpclient:127.0.0.1:{port1}"]
        if self._agent_on_second:
            ports.reverse()
        serials = ["--serial0", ports[0], "--serial1", ports[1]]
        serials += [word for number in (2, 5, 6, 7, 8) for word in (f"--serial{number}", "none:0")]
        defaults = ",".join(str(file) for file in (*self._airframe.files, ours))
        options = [
            "--model",
            self._airframe.model,
            "--speedup",
            str(BOOT_SPEED),
            "--home",
            home,
            "--defaults",
            defaults,
        ]
        command = [str(self._binary), *options, "--rc-in-port", "{free}", *serials]
        radio_port, sockets = await self._run(command)
        self.port, truth, self._radio = sockets
        self._radio.connect(("127.0.0.1", radio_port))
        self.truth = Truth(truth)
        if self.receiver is not Receiver.NONE:
            self._feeding = asyncio.create_task(self._feed(_CHANNELS[self.receiver]))
        try:
            await wait_for("the autopilot to be ready to arm", self._ready, BOOT_S)
        except TimeoutError as error:
            raise NoAutopilot(f"{error}; it said: {self.truth.texts[-3:]}") from None
        await self.truth.set_parameter("SIM_SPEEDUP", 1)

    async def _run(self, command: list[str]) -> tuple[int, list[socket.socket]]:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        with ours, theirs, (self._folder / "autopilot.log").open("ab") as log:
            self._process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-m", "bench.closed_loopback", str(theirs.fileno()), *command),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                pass_fds=[theirs.fileno()],
                cwd=self._folder,
                env={"PYTHONPATH": str(CHECKOUT), "HOME": str(self._folder), "PATH": "/usr/bin:/bin"},
            )
            theirs.close()
            words, descriptors, _, _ = await asyncio.to_thread(socket.recv_fds, ours, 256, SOCKETS)
        sockets = [socket.socket(fileno=descriptor) for descriptor in descriptors]
        if len(sockets) != SOCKETS:
            reason = words.removeprefix(REFUSED).decode() or "see autopilot.log"
            raise NoAutopilot(f"no network of its own for the autopilot: {reason}")
        for one in sockets:
            one.setblocking(False)
        return int(words), sockets

    @property
    def namespace(self) -> str:
        """The file of its network namespace, for bench.namespaces.inside_namespace."""
        assert self._process is not None
        return f"/proc/{self._process.pid}/ns/net"

    def _ready(self) -> bool:
        if self._process is not None and self._process.returncode is not None:
            log = (self._folder / "autopilot.log").read_text(errors="replace")
            raise NoAutopilot(f"the autopilot ended: {log[-500:]}")
        return self.truth.has_position

    async def turn_switch(self, width_us: int) -> None:
        """Moves the transmitter's mode switch to this pulse width (channel 5)."""
        channels = list(_CHANNELS[self.receiver])
        channels[4] = width_us
        if self._feeding is not None:
            self._feeding.cancel()
        self._feeding = asyncio.create_task(self._feed(tuple(channels)))

    async def _feed(self, channels: tuple[int, ...]) -> None:
        assert self._radio is not None
        packet = struct.pack("<16H", *channels, *(1500,) * 8)
        for _ in range(round(FED_FOR_S / FEED_S)):
            with contextlib.suppress(OSError):  # it does not listen there before it has started
                self._radio.send(packet)
            await asyncio.sleep(FEED_S)

    async def stop(self) -> None:
        if self._feeding is not None:
            self._feeding.cancel()
            await asyncio.gather(self._feeding, return_exceptions=True)
        if self._process is not None and self._process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()
        if self._radio is not None:
            self.truth.close()
            for sock in (self.port, self._radio):
                sock.close()


@contextlib.asynccontextmanager
async def flying(binary: Path, folder: Path, **options: Any) -> AsyncIterator[RealAutopilot]:
    """`options` as for RealAutopilot."""
    autopilot = RealAutopilot(binary, folder, **options)
    try:
        await autopilot.start()
        yield autopilot
    finally:
        await asyncio.shield(autopilot.stop())
