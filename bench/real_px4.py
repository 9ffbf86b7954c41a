"""A real PX4 that simulates its own quadcopter (SIH), on an isolated loopback.

    async with flying_px4(build, folder) as autopilot:
        autopilot.port      # its link for an onboard computer: the agent's side
        autopilot.station   # its link for a ground station: its true motion, and the measurement's own queries

`build` is the folder of a SITL build, with `bin/px4` and `etc/`, from any source. It flies in real time. It keeps a
lock for its number in the machine's temporary folder, so those that fly at once need different numbers.

SIH has no radio receiver. RC_CHANNELS_OVERRIDE counts as one for PX4, so that is what `receiver` feeds.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import shutil
import socket
import struct
import sys
from collections.abc import AsyncIterator, Mapping
from pathlib import Path
from typing import Any, Final

from bench.closed_loopback import REFUSED, SOCKETS
from bench.real_autopilot import NoAutopilot, Receiver
from bench.rig import CHECKOUT, HOME, wait_for
from bench.tap import ModeSeen, Motion
from wire.dialect import build as built
from wire.dialect import decode, mavlink
from wire.frames import MalformedFrame, source, split_frames

ONBOARD_PORT: Final = 14540
LAST_ONBOARD_PORT: Final = 14549
STATION_PORT: Final = 14550
"""The ports to which PX4's start-up script sends: the first of the instance, the others of all."""
BOOT_S: Final = 60.0
STATION: Final = 200
"""A system id that is nobody's ground station."""
HEARTBEAT_S: Final = 1.0
FEED_S: Final = 0.04
MOTION_US: Final = 100_000
ASK_S: Final = 0.5
FORCE: Final = 21196.0
_TRUTH: Final = mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION
_EARTH_M: Final = 6_378_137.0
_IGNORE: Final = 65535
_THROTTLES: Final = {Receiver.LOW: 1000, Receiver.CENTRED: 1500}
_CHANNELS: Final = {
    f"RC_MAP_{axis}": float(number) for number, axis in enumerate(("ROLL", "PITCH", "THROTTLE", "YAW"), 1)
}
_BATTERY: Final = {"SIM_BAT_DRAIN": 100_000.0}
"""Otherwise its battery is half empty after a minute, and needed for the way home."""
_WHOLE: Final = mavlink.MAV_PARAM_TYPE_INT32
_START_UP: Final = Path("init.d-posix") / "rcS"
_SYSTEM_ID: Final = "param set MAV_SYS_ID $((px4_instance+1))"


class Station:
    """The newest message of each kind on PX4's link for a ground station, its true motion, and requests to it.

    `motions`, `tilts` and `texts` are as those of bench.truth.

    Sends heartbeats while `is_present`: PX4 sends STATUSTEXT only on a link with a ground station. But then PX4 does
    not notice that the people behind its other link are gone.
    """

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        self._loop = asyncio.get_running_loop()
        self._address: tuple[str, int] | None = None
        self._sequence = 0
        self.newest: dict[str, Any] = {}
        self.motions: list[Motion] = []
        self.tilts: list[tuple[float, float]] = []
        """(time, degrees from level)."""
        self.modes: list[ModeSeen] = []
        self.texts: list[tuple[float, str]] = []
        self.acks: list[tuple[int, int]] = []
        self.is_present = False
        self.receiver = Receiver.NONE
        self._asked_at = 0.0
        self._loop.add_reader(sock, self._read)
        self._working = [asyncio.create_task(self._beat()), asyncio.create_task(self._feed())]

    async def _beat(self) -> None:
        gcs, none = mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID
        while True:
            if self.is_present:
                self.send(mavlink.MAVLink_heartbeat_message(gcs, none, 0, 0, mavlink.MAV_STATE_ACTIVE, 3))
            await asyncio.sleep(HEARTBEAT_S)

    async def _feed(self) -> None:
        """The output of a receiver whose transmitter lies on the table."""
        while True:
            throttle = _THROTTLES.get(self.receiver)
            if throttle is not None:
                channels = (1500, 1500, throttle, 1500, *(_IGNORE,) * 4)
                self.send(mavlink.MAVLink_rc_channels_override_message(1, 1, *channels))
            await asyncio.sleep(FEED_S)

    @property
    def alt_m(self) -> float:
        """Its true height above HOME."""
        return self.motions[-1].alt_m if self.motions else math.nan

    def disarm(self) -> None:
        """Disarms in any state."""
        self.send(
            mavlink.MAVLink_command_long_message(
                1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0.0, FORCE, 0.0, 0.0, 0.0, 0.0, 0.0
            )
        )

    async def set_whole(self, name: str, value: int) -> None:
        """Writes a parameter of whole numbers, until it reports this value. Raises TimeoutError."""
        as_float = struct.unpack("<f", struct.pack("<i", value))[0]
        asked_at = 0.0

        def done() -> bool:
            nonlocal asked_at
            if self._loop.time() - asked_at > ASK_S:
                asked_at = self._loop.time()
                self.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), as_float, _WHOLE))
            told = self.newest.get("PARAM_VALUE")
            return told is not None and told.param_id == name and bytes_of(told.param_value) == bytes_of(as_float)

        await wait_for(f"{name} to be {value}", done, 10)

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
        for work in self._working:
            work.cancel()
        await asyncio.gather(*self._working, return_exceptions=True)
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
        kind, now = message.get_type(), self._loop.time()
        self.newest[kind] = message
        if kind == "STATUSTEXT":
            self.texts.append((now, message.text))
        elif kind == "COMMAND_ACK":
            self.acks.append((message.command, message.result))
        elif kind == "HEARTBEAT":
            self.modes.append(ModeSeen(now, message.custom_mode, bool(message.base_mode & 0x80)))
            if not self.motions or now - self.motions[-1].at > 1.0:
                self._ask_for_motion(now)
        elif kind == "HIL_STATE_QUATERNION":
            self.motions.append(_motion(message, now))
            _, x, y, _ = message.attitude_quaternion
            self.tilts.append((now, math.degrees(math.acos(max(-1.0, 1 - 2 * (x * x + y * y))))))

    def _ask_for_motion(self, now: float) -> None:
        if now - self._asked_at > ASK_S:
            self._asked_at = now
            self.send(
                mavlink.MAVLink_command_long_message(
                    1, 1, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0, _TRUTH, MOTION_US, 0, 0, 0, 0, 0
                )
            )


def bytes_of(value: float) -> bytes:
    return struct.pack("<f", value)


def _motion(state: Any, now: float) -> Motion:
    north_m = math.radians(state.lat * 1e-7 - HOME[0]) * _EARTH_M
    east_m = math.radians(state.lon * 1e-7 - HOME[1]) * _EARTH_M * math.cos(math.radians(HOME[0]))
    speed_mps = math.hypot(state.vx, state.vy) / 100.0
    return Motion(now, state.alt / 1000.0 - HOME[2], speed_mps, -state.vz / 100.0, north_m, east_m)


class RealPx4:
    """One PX4 process. `port`, `station` and `truth`, which is the station, exist after `start`."""

    def __init__(
        self,
        build: Path,
        folder: Path,
        *,
        parameters: Mapping[str, float] | None = None,
        home: tuple[float, float, float] = HOME,
        number: int = 0,
        receiver: Receiver = Receiver.NONE,
    ) -> None:
        """Sets `parameters` before start-up; COM_RC_IN_MODE is set again by start-up, so write it afterwards.

        `folder`: used by this process alone. `home`: degrees, metres above sea level. `number`: of the instance.
        """
        self.port: socket.socket
        self.station: Station
        self.receiver = receiver
        self._number = number
        self._build = build.resolve()
        self._folder = folder
        self._parameters = {**_CHANNELS, **_BATTERY, **(parameters or {})}
        self._home = home
        self._process: asyncio.subprocess.Process | None = None

    async def start(self) -> None:
        """Starts it and waits until it could arm. Raises NoAutopilot."""
        self._folder.mkdir(parents=True, exist_ok=True)
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        ports = f"{min(ONBOARD_PORT + self._number, LAST_ONBOARD_PORT)},{STATION_PORT},0"
        command = [str(self._build / "bin" / "px4"), "-d", str(self._start_up()), "-w", str(self._folder)]
        command += ["-i", str(self._number)]
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
        self.station.receiver = self.receiver
        try:
            await wait_for("PX4 to be ready to arm", self._ready, BOOT_S)
        except TimeoutError as error:
            raise NoAutopilot(f"{error}; it said: {self.station.texts[-3:]}") from None

    @property
    def truth(self) -> Station:
        return self.station

    def _start_up(self) -> Path:
        """Its scripts. Those of an instance with a number give it another system id; here each is alone on its line."""
        if self._number == 0:
            return self._build / "etc"
        scripts = self._folder / "scripts"
        shutil.copytree(self._build / "etc", scripts)
        first = scripts / _START_UP
        first.write_text(first.read_text().replace(_SYSTEM_ID, "param set MAV_SYS_ID 1"))
        return scripts

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
