"""MAVSDK's own server (the program in its wheel) and a typical client program, in a separate environment."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from bench.peers.environment import environment_with

PACKAGE: Final = "mavsdk<4"
"""The last version with the server in its wheel; from 4 on it is a library inside the program."""
ROOM_BYTES: Final = 500_000_000
SERVER: Final = "mavsdk/bin/mavsdk_server"
PROGRAM: Final = Path(__file__).with_name("mavsdk_program.py")
ANSWER_WITHIN_S: Final = 600.0


class PeerFailed(Exception):
    """MAVSDK failed; the message is its own."""


@dataclass(frozen=True, slots=True)
class Installed:
    """A Python, and the location of MAVSDK if it is not among its packages."""

    python: Path
    path: Path | None = None

    @property
    def environment(self) -> dict[str, str]:
        more = {} if self.path is None else {"PYTHONPATH": str(self.path)}
        return {**os.environ, "PYTHONWARNINGS": "ignore", **more}


async def mavsdk_in(folder: Path) -> Installed:
    """Returns the installation of the tests (deploy/install_test_parts.sh) if it exists, else one in `folder`,
    installed from the package index if missing. Raises bench.peers.environment.CannotInstall."""
    of_tests = Path(sys.prefix) / "stock-clients"
    if (of_tests / SERVER).exists():
        return Installed(Path(sys.executable), of_tests)
    packages = f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages"
    made = await environment_with(folder, "mavsdk", PACKAGE, holds=f"{packages}/{SERVER}", room_bytes=ROOM_BYTES)
    return Installed(made / "bin" / "python")


class MavSdk:
    """One run of the server, and of its client program."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process

    async def do(self, action: str, **said: Any) -> Any:
        """Returns its answer, with the elapsed seconds as `s`. Raises PeerFailed."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"do": action, **said}).encode() + b"\n")
        return await self.answer()

    async def answer(self) -> Any:
        assert self._process.stdout is not None
        try:
            line = await asyncio.wait_for(self._process.stdout.readline(), ANSWER_WITHIN_S)
        except TimeoutError:
            raise PeerFailed(f"no answer in {ANSWER_WITHIN_S:g} s") from None
        if not line:
            raise PeerFailed("it has ended")
        answer = json.loads(line)
        if "failed" in answer:
            raise PeerFailed(answer["failed"])
        return answer


@contextlib.asynccontextmanager
async def mavsdk_on(installed: Installed, port: int, grpc_port: int, log: Path) -> AsyncIterator[MavSdk]:
    """Listens for an autopilot on UDP `port` of this host, and connects. Raises PeerFailed."""
    with log.open("ab") as errors:
        process = await asyncio.create_subprocess_exec(
            *(str(installed.python), str(PROGRAM), f"udpin://0.0.0.0:{port}", str(grpc_port)),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=errors,
            env=installed.environment,
            limit=4 * 1024 * 1024,
            start_new_session=True,
        )
    try:
        peer = MavSdk(process)
        await peer.answer()
        yield peer
    finally:
        await _end(process)


async def _end(process: asyncio.subprocess.Process) -> None:
    """Ends the program and the server that it started: they have their own process group."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, 15)
    try:
        await asyncio.wait_for(process.wait(), 5)
    except TimeoutError:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, 9)
        await process.wait()
