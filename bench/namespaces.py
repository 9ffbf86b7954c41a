"""Hosts of an emulated network: a network namespace each, joined by TUN devices through `bench.link_emulator`.

    async with emulated_network({"drone": Profile(delay_s=0.075, loss=0.05)}) as net:
        agent = await net.run_in("drone", "tower-agent", ...)
        await net.change("drone", Profile(black_out=True))

Needs root, iproute2 and /dev/net/tun (`why_not` reports what is missing). Everything is removed at the end, whatever
happens.
"""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import fcntl
import json
import os
import shutil
import signal
import struct
import subprocess
import sys
from collections.abc import AsyncIterator, Iterator, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

from bench.link_model import Profile

HOSTS: Final = ("tower", "drone", "browser")
DEVICE: Final = "link0"
TUN: Final = Path("/dev/net/tun")
MTU: Final = 1500
CHECKOUT: Final = Path(__file__).resolve().parent.parent

_TUNSETIFF: Final = 0x400454CA
_IFF_TUN, _IFF_NO_PI = 0x0001, 0x1000
_CLONE_NEWNET: Final = 0x40000000


def why_not() -> str | None:
    """Returns what is missing on this machine, and how to get it; None if nothing is."""
    if os.geteuid() != 0:
        return "root, for network namespaces"
    if shutil.which("ip") is None:
        return "iproute2 (Debian: apt-get install iproute2)"
    if not TUN.exists():
        return "/dev/net/tun (the kernel's tun device)"
    return None


class Carried(NamedTuple):
    """Packets of one access link, delivered and lost, each way; and the bytes of the delivered ones, with all headers
    from IP on."""

    passed_up: int
    lost_up: int
    passed_down: int
    lost_down: int
    bytes_up: int = 0
    bytes_down: int = 0


class Network:
    """Three hosts. `address(name)` returns the address of one."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._emulator: asyncio.subprocess.Process | None = None
        self._processes: list[asyncio.subprocess.Process] = []
        self._turn = asyncio.Lock()

    def address(self, host: str) -> str:
        return f"10.77.0.{HOSTS.index(host) + 1}"

    def namespace(self, host: str) -> str:
        return f"{self._label}-{host}"

    def command_in(self, host: str, *command: str) -> list[str]:
        """Returns the same command, in that host's namespace."""
        return ["ip", "netns", "exec", self.namespace(host), *command]

    async def run_in(self, host: str, *command: str, **options: Any) -> asyncio.subprocess.Process:
        """Starts a process there; it ends with the network. `options` as for create_subprocess_exec."""
        process = await asyncio.create_subprocess_exec(*self.command_in(host, *command), **options)
        self._processes.append(process)
        return process

    @contextlib.contextmanager
    def inside(self, host: str) -> Iterator[None]:
        """What this thread opens within the block belongs to that host, and stays there. No await inside the block."""
        with inside_namespace(f"/run/netns/{self.namespace(host)}"):
            yield

    async def change(self, host: str, profile: Profile | None = None, **ways: Profile) -> None:
        """Sets a new profile of the host's access link, both ways or `up=`, `down=`; in force on return."""
        if profile is not None:
            ways = {"up": profile, "down": profile}
        answer = await self._say({"host": host, **{way: one.as_dict() for way, one in ways.items()}})
        if answer != b"done\n":
            raise RuntimeError("the link emulator has died")

    async def carried(self, host: str) -> Carried:
        """Returns the traffic on the host's access link since the start."""
        answer = await self._say({"host": host, "count": True})
        if not answer:
            raise RuntimeError("the link emulator has died")
        ways = json.loads(answer)
        (passed_up, lost_up, bytes_up), (passed_down, lost_down, bytes_down) = ways["up"], ways["down"]
        return Carried(passed_up, lost_up, passed_down, lost_down, bytes_up, bytes_down)

    async def _say(self, words: dict[str, Any]) -> bytes:
        assert self._emulator is not None and self._emulator.stdin is not None and self._emulator.stdout is not None
        async with self._turn:
            self._emulator.stdin.write(json.dumps(words).encode() + b"\n")
            return await self._emulator.stdout.readline()

    async def start(self, seed: int) -> None:
        words, descriptors = [], []
        try:
            for host in HOSTS:
                name = self.namespace(host)
                _ip("netns", "add", name)
                _ip("-n", name, "link", "set", "lo", "up")
                with self.inside(host):
                    descriptor = _open_tun()
                descriptors.append(descriptor)
                _ip("-n", name, "addr", "add", f"{self.address(host)}/24", "dev", DEVICE)
                _ip("-n", name, "link", "set", DEVICE, "mtu", str(MTU), "up")
                words.append(f"{host}={self.address(host)}={descriptor}")
            self._emulator = await asyncio.create_subprocess_exec(
                *(sys.executable, "-m", "bench.link_emulator", str(seed), *words),
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                pass_fds=descriptors,
                cwd=CHECKOUT,
            )
        finally:
            for descriptor in descriptors:
                os.close(descriptor)
        assert self._emulator.stdout is not None
        if await self._emulator.stdout.readline() != b"ready\n":
            raise RuntimeError("the link emulator did not start")

    async def stop(self) -> None:
        """Runs each step even if another fails: nothing may stay behind."""
        for process in reversed(self._processes):
            await _end(process)
        if self._emulator is not None:
            await _end(self._emulator)
        for host in HOSTS:
            with contextlib.suppress(subprocess.CalledProcessError):
                _ip("netns", "del", self.namespace(host))


@contextlib.asynccontextmanager
async def emulated_network(profiles: Mapping[str, Profile] | None = None, *, seed: int = 1) -> AsyncIterator[Network]:
    """`profiles`: access links of hosts, the same both ways; a host without a profile has a perfect link."""
    network = Network(f"bench{os.getpid()}")
    try:
        await network.start(seed)
        for host, profile in (profiles or {}).items():
            await network.change(host, profile)
        yield network
    finally:
        await asyncio.shield(network.stop())


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)


def _open_tun() -> int:
    descriptor = os.open(TUN, os.O_RDWR)
    try:
        fcntl.ioctl(descriptor, _TUNSETIFF, struct.pack("16sH22x", DEVICE.encode(), _IFF_TUN | _IFF_NO_PI))
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


@contextlib.contextmanager
def inside_namespace(path: str) -> Iterator[None]:
    """What this thread opens within the block belongs to the network namespace of this file."""
    home = os.open("/proc/thread-self/ns/net", os.O_RDONLY)
    try:
        _enter(path)
        try:
            yield
        finally:
            _setns(home)
    finally:
        os.close(home)


def _enter(path: str) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        _setns(descriptor)
    finally:
        os.close(descriptor)


def _setns(descriptor: int) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.setns(descriptor, _CLONE_NEWNET) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))


async def _end(process: asyncio.subprocess.Process) -> None:
    if process.returncode is None:
        with contextlib.suppress(ProcessLookupError):
            process.send_signal(signal.SIGTERM)
        try:
            await asyncio.wait_for(process.wait(), 5)
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
    transport = getattr(process, "_transport", None)
    if transport is not None:
        transport.close()
