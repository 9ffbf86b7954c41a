"""The whole video chain as real programs: tower, agent with its video process, simulator with its camera."""

from __future__ import annotations

import asyncio
import contextlib
import io
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final

import av
from agent_fakes import until
from udp_proxy import running_proxy
from video_world import Watcher, watching_video
from worlds.clock_strip import age_ms, read_clock
from worlds.free_ports import free_tcp_port, free_udp_ports
from worlds.processes import Visitor, World, wait_for
from worlds.video_seen import video_process_of

from wire.dialect import decode
from wire.frames import split_frames
from wire.video import Codec, Unit

PICTURES: Final = "width=320&height=240&rate=15"
SIMULATOR: Final = ("--boot-s", "1", "--seed", "3", "--speed", "1", "--radio", "low")
HOME: Final = ("--count", "1", "--home", "47.3977,8.5456,488,0")
STICKS: Final = ("MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE")


@dataclass(frozen=True)
class Place:
    """The tower's details that a viewer needs."""

    base_url: str


class Lateness:
    """Measures how late this machine runs a timer: nothing in a test can be faster than that."""

    def __init__(self) -> None:
        self.worst_s = 0.0

    async def watch(self) -> None:
        while True:
            due_at = time.monotonic() + 0.01
            await asyncio.sleep(0.01)
            self.worst_s = max(self.worst_s, time.monotonic() - due_at)


@contextlib.asynccontextmanager
async def measured_lateness() -> AsyncIterator[Lateness]:
    lateness = Lateness()
    watching = asyncio.create_task(lateness.watch())
    try:
        yield lateness
    finally:
        watching.cancel()


@dataclass
class Line:
    """The line between agent and autopilot. Records the arrival of sticks at the autopilot."""

    sticks_at: list[float] = field(default_factory=list)

    def hear(self, datagram: bytes) -> None:
        names = [message.get_type() for frame in split_frames(datagram) if (message := decode(frame)) is not None]
        self.sticks_at += [time.monotonic()] * sum(name in STICKS for name in names)

    def longest_gap_s(self, since: float) -> float:
        times = [since, *(at for at in self.sticks_at if at >= since), time.monotonic()]
        return max(later - sooner for sooner, later in pairwise(times))


@contextlib.asynccontextmanager
async def flown(world: World, drone: str) -> AsyncIterator[Line]:
    """Runs the agent, simulator and camera of a drone. Yields the line between agent and autopilot."""
    (port,) = free_udp_ports(1)
    world.cameras = {drone: free_tcp_port()}
    world.start_agent(drone, f"udpin:127.0.0.1:{port}", *world.look_through(drone, PICTURES))
    line = Line()
    async with running_proxy(("127.0.0.1", port)) as proxy:
        proxy.hear_down = line.hear
        where = ("--out", f"udp:127.0.0.1:{proxy.port}", "--camera", str(world.cameras[drone]))
        world.start("simulator", "tower-sim", *HOME, *where, *SIMULATOR)
        await asyncio.to_thread(world.wait_until_online, world.visitor("admin"), 1)
        yield line


@contextlib.asynccontextmanager
async def viewer(
    visitor: Visitor, query: str = "?quality=medium&codec=mpeg1", drone_id: int = 1
) -> AsyncIterator[Watcher]:
    """A viewer of the video."""
    place: Any = Place(visitor.address)
    headers = {"Cookie": visitor.cookie, "Origin": visitor.address}
    async with watching_video(place, drone_id, headers, query=query) as watcher:
        yield watcher


async def pictures_come(watcher: Watcher, count: int = 5, timeout_s: float = 60.0) -> float:
    """Waits for new pictures from now on. Returns the seconds until the first."""
    asked_at, had = time.monotonic(), len(watcher.units)
    await until(lambda: len(watcher.units) >= had + count, timeout_s, f"pictures; told: {watcher.reported[-4:]}")
    return watcher.came_at[had] - asked_at


def unbroken(units: list[Unit]) -> list[Unit]:
    """Returns the longest run from a key picture on without a gap."""
    runs: list[list[Unit]] = []
    for unit in units:
        if runs and unit.sequence == runs[-1][-1].sequence + 1 and not unit.is_break:
            runs[-1].append(unit)
        elif unit.key:
            runs.append([unit])
    return max(runs, key=len, default=[])


def decoded(units: list[Unit]) -> list[av.VideoFrame]:
    """Returns a decoder's pictures of one stream, in order."""
    form = "mpegts" if units[0].codec is Codec.MPEG1 else "h264"
    with av.open(io.BytesIO(b"".join(unit.payload for unit in units)), format=form) as container:
        return list(container.decode(video=0))


def ages_ms(units: list[Unit]) -> list[int]:
    """Returns the unit's capture time less the time on the picture's strip. Ignores pictures without a readable
    strip."""
    unix_ahead_s = time.time() - time.monotonic()
    ages = []
    for unit, frame in zip(units, decoded(units), strict=False):
        luma = frame.to_ndarray(format="yuv420p")[: frame.height]
        read = read_clock(luma[: unit.height, : unit.width])
        if read is not None and unit.capture_us:
            ages.append(age_ms(read, round(unit.capture_us / 1000 + unix_ahead_s * 1000)))
    return ages


def child_of(world: World, drone: str) -> int:
    """Waits for the video process of a drone's agent. Returns its pid."""
    agent = world.running(f"agent-{drone}").pid
    return wait_for("a video process", lambda: video_process_of(agent))


def another_child(world: World, drone: str, than: int) -> int | None:
    """Returns the pid of the process that replaced an earlier video process, or None."""
    now = video_process_of(world.running(f"agent-{drone}").pid)
    return None if now == than else now
