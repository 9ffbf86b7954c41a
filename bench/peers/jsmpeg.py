"""JSMpeg's documented set-up: ffmpeg posts MPEG-TS to a relay in Node, a page plays what the relay sends it.

`ffmpeg -f v4l2 ... -f mpegts -codec:v mpeg1video -s 640x480 -b:v 1000k -bf 0 http://relay/secret` is the command in its
documentation; here ffmpeg reads the simulator's camera directly. The player has its defaults.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import shutil
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bench.peers.environment import CannotInstall

HERE: Final = Path(__file__).resolve().parent / "jsmpeg_relay"
PLAYER: Final = Path("node_modules/@cycjimmy/jsmpeg-player/dist/jsmpeg-player.umd.min.js")
SECRET: Final = "bench"
START_S: Final = 30.0
CANVAS: Final = "#video"
PAGE: Final = """<!doctype html><meta charset="utf-8"><title>JSMpeg</title>
<style>body {{ margin: 0; background: #222 }} canvas {{ width: {width}px; height: {height}px }}</style>
<canvas id="video"></canvas>
<script src="/jsmpeg.js"></script>
<script>window.player = new JSMpeg.Player({url!r}, {{ canvas: document.getElementById('video') }});</script>
"""

CommandAt = Callable[..., list[str]]
"""Takes the words of a command; returns those that run it on the right host."""


@dataclass(frozen=True, slots=True)
class Jsmpeg:
    """The installed set-up."""

    folder: Path

    @property
    def player(self) -> Path:
        """One script that contains its WASM."""
        return self.folder / PLAYER


async def jsmpeg_in(folder: Path) -> Jsmpeg:
    """Installs in `folder`, with npm's own settings, at the versions of the lock file. Raises CannotInstall."""
    for program, package in (("ffmpeg", "ffmpeg"), ("node", "nodejs"), ("npm", "npm")):
        if shutil.which(program) is None:
            raise CannotInstall(f"{program} is not there (Debian: apt-get install {package})")
    place = folder / HERE.name
    lock = "package-lock.json"
    if (place / PLAYER).exists() and (place / lock).read_bytes() == (HERE / lock).read_bytes():
        shutil.copy(HERE / "relay.js", place)
        return Jsmpeg(place)
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(HERE, place, ignore=shutil.ignore_patterns("node_modules"))
    process = await asyncio.create_subprocess_exec(
        *("npm", "ci", "--no-audit", "--no-fund", "--loglevel=error"),
        cwd=place,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
    )
    said, _ = await process.communicate()
    if process.returncode:
        shutil.rmtree(place, ignore_errors=True)
        raise CannotInstall(said.decode(errors="replace").strip()[-300:])
    return Jsmpeg(place)


@dataclass(frozen=True, slots=True)
class Relay:
    """A running relay."""

    pid: int
    address: str
    stream_port: int
    viewers_port: int

    @property
    def viewers_url(self) -> str:
        return f"ws://{self.address}:{self.viewers_port}/"


@contextlib.asynccontextmanager
async def relay_at(jsmpeg: Jsmpeg, address: str, log: Path, command_at: CommandAt) -> AsyncIterator[Relay]:
    """Runs the Node relay, listening at `address` on the host of `command_at`."""
    with log.open("ab") as complaints:
        process = await asyncio.create_subprocess_exec(
            *command_at("node", str(jsmpeg.folder / "relay.js"), address, SECRET),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=complaints,
        )
    try:
        assert process.stdout is not None
        ports = json.loads(await asyncio.wait_for(process.stdout.readline(), START_S))
        yield Relay(process.pid, address, ports["stream"], ports["viewers"])
    finally:
        await _end(process)


@contextlib.asynccontextmanager
async def ffmpeg_to(
    relay: Relay, camera: str, size: str, rate_hz: float, bits_per_s: int, log: Path, command_at: CommandAt
) -> AsyncIterator[int]:
    """Runs the encoder as documented, until the block ends. `camera`: the MJPEG URL; `size`: such as 320x240. Yields
    its pid."""
    # The rate precedes the input, like a camera's: MJPEG over HTTP does not state its own.
    words = ["ffmpeg", "-nostdin", "-hide_banner", "-loglevel", "error"]
    words += ["-f", "mpjpeg", "-r", f"{rate_hz:g}", "-i", camera]
    words += ["-f", "mpegts", "-codec:v", "mpeg1video", "-s", size, "-b:v", str(bits_per_s), "-bf", "0"]
    words += [f"http://{relay.address}:{relay.stream_port}/{SECRET}"]
    with log.open("ab") as complaints:
        process = await asyncio.create_subprocess_exec(
            *command_at(*words), stdin=asyncio.subprocess.DEVNULL, stdout=complaints, stderr=complaints
        )
    try:
        yield process.pid
    finally:
        await _end(process)


async def _end(process: asyncio.subprocess.Process) -> None:
    if process.returncode is None:
        with contextlib.suppress(ProcessLookupError):
            process.terminate()
        try:
            await asyncio.wait_for(process.wait(), 5)
        except TimeoutError:
            process.kill()
            await process.wait()
    if process.stdout is not None:
        process._transport.close()  # type: ignore[attr-defined]
