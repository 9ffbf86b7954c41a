"""Parts fail during a flight by hand: the drone holds, and afterwards the lease follows the rules."""

import asyncio
import contextlib
import shutil
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
from udp_proxy import running_proxy
from worlds.free_ports import free_udp_ports
from worlds.pilot import ALT_HOLD, Pilot, at_the_controls, fly_by_hand, watching
from worlds.processes import World, kill_9, wait_for

from wire.dialect import decode
from wire.frames import split_frames

HOME = ("--count", "1", "--home", "47.3977,8.5456,488,0")
SIMULATOR = ("--boot-s", "1", "--seed", "3", "--speed", "1", "--radio", "low")


@pytest.fixture(scope="module")
def one_drone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("one-drone")
    with World(folder) as world:
        world.add_user("alice")
        world.add_user("admin", "admin")
        assert world.add_drone("Kestrel", "alice") == 1
    return folder


@pytest.fixture
def tower_alone(tmp_path: Path, one_drone: Path) -> Iterator[World]:
    shutil.copytree(one_drone, tmp_path, dirs_exist_ok=True)
    with World(tmp_path, prepared=True) as world:
        world.start_tower()
        yield world


@pytest.fixture
def world(tower_alone: World) -> World:
    tower_alone.start_simulated("Kestrel", options=SIMULATOR)
    tower_alone.wait_until_online(tower_alone.visitor("admin"), 1)
    return tower_alone


@contextlib.asynccontextmanager
async def beside_the_autopilot(world: World) -> AsyncIterator[Pilot]:
    """Adds an agent and simulator. Yields an observer of the autopilot's line, which works without the tower."""
    (port,) = free_udp_ports(1)
    world.start_agent("Kestrel", f"udpin:127.0.0.1:{port}")
    seen = Pilot(None, None, 1)  # type: ignore[arg-type]
    async with running_proxy(("127.0.0.1", port)) as line:

        async def read() -> None:
            while True:
                while line.up:
                    _, datagram = line.up.pop(0)
                    for frame in split_frames(datagram):
                        seen._see(decode(frame))
                await asyncio.sleep(0.02)

        reading = asyncio.create_task(read())
        world.start("simulator", "tower-sim", *HOME, "--out", f"udp:127.0.0.1:{line.port}", *SIMULATOR)
        await asyncio.to_thread(world.wait_until_online, world.visitor("admin"), 1)
        yield seen
        reading.cancel()


async def holds(watcher: Pilot, near_m: float, timeout_s: float = 10.0) -> None:
    """Waits for altitude hold, level, near its earlier position."""
    await watcher.until(lambda: watcher.mode == ALT_HOLD and watcher.altitude_m > 0, "altitude hold", timeout_s)
    await watcher.until(lambda: max(map(abs, watcher.roll_pitch_rad)) < 0.1, "level", 30.0)
    assert abs(watcher.altitude_m - near_m) < 4.0


async def test_the_browser_dies(world: World) -> None:
    admin, alice = world.visitor("admin"), world.visitor("alice")
    async with watching(admin, 1) as watcher:
        async with at_the_controls(alice, 1) as pilot:
            await fly_by_hand(pilot)
            pilot.hold_sticks(pitch=600)
            await pilot.until(lambda: abs(pilot.roll_pitch_rad[1]) > 0.1, "leaning forward")
            height_m = watcher.altitude_m
            pilot._socket.transport.abort()
        await holds(watcher, height_m)
        # The lease lasts for the grace time: alice can come back and fly on.
        drone = await asyncio.to_thread(alice.drone, 1)
        assert drone["holder"]["name"] == "alice"
        assert any(event["type"] == "hold" and event["step"] == "confirmed" for event in watcher.events)


async def test_the_tower_dies(tower_alone: World) -> None:
    world, alice = tower_alone, tower_alone.visitor("alice")
    async with beside_the_autopilot(world) as seen:
        async with at_the_controls(alice, 1) as pilot:
            await fly_by_hand(pilot)
            pilot.hold_sticks(roll=-500)
            await pilot.until(lambda: abs(pilot.roll_pitch_rad[0]) > 0.1, "leaning")
            height_m, epoch = pilot.altitude_m, (await asyncio.to_thread(alice.drone, 1))["epoch"]
            await asyncio.to_thread(kill_9, world.tower)
        # The agent holds by itself; nothing else can report it. The next tower may start only when the hold is over and
        # the drone is on its way home, so the test checks the hold here.
        await holds(seen, height_m)
        await asyncio.to_thread(
            wait_for, "the agent's own hold", lambda: "hold: confirmed" in world.log_of("agent-Kestrel")
        )
        await asyncio.to_thread(world.start_tower)
        await asyncio.to_thread(world.wait_until_online, world.visitor("admin"), 1)
    drone = await asyncio.to_thread(alice.drone, 1)
    assert (drone["holder"]["name"], drone["epoch"]) == ("alice", epoch)


async def test_the_agent_dies(world: World) -> None:
    """Only the autopilot is left: its own failsafe acts, and the tower reports offline."""
    admin, alice = world.visitor("admin"), world.visitor("alice")
    async with watching(admin, 1) as watcher, at_the_controls(alice, 1) as pilot:
        await fly_by_hand(pilot)
        agent = world.running("agent-Kestrel")
        await asyncio.to_thread(kill_9, agent)
        await watcher.until(
            lambda: any(e["type"] == "drone" and not e["drone"]["online"] for e in watcher.events), "offline"
        )
        drone = await asyncio.to_thread(alice.drone, 1)
        assert (drone["online"], drone["holder"]["name"]) == (False, "alice")
        # systemd would restart it. The lease is unchanged, and the pilot flies on.
        await asyncio.to_thread(world.restart, "agent-Kestrel")
        await asyncio.to_thread(world.wait_until_online, admin, 1)
        await pilot.centre_sticks()
        await pilot.set_mode(5)
        await pilot.until(lambda: pilot.armed and pilot.climb_mps > -0.3, "flown on")
