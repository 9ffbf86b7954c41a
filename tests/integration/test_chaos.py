"""Parts die while somebody flies by hand: the drone holds, and afterwards the lease is what the rules say."""

import asyncio
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from worlds.pilot import ALT_HOLD, Pilot, at_the_controls, fly_by_hand, watching
from worlds.processes import World, kill_9, wait_for

SIMULATOR = ("--boot-s", "1", "--seed", "3", "--speed", "1", "--radio")


@pytest.fixture(scope="module")
def one_drone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("one-drone")
    with World(folder) as world:
        world.add_user("alice")
        world.add_user("admin", "admin")
        assert world.add_drone("Kestrel", "alice") == 1
    return folder


@pytest.fixture
def world(tmp_path: Path, one_drone: Path) -> Iterator[World]:
    shutil.copytree(one_drone, tmp_path, dirs_exist_ok=True)
    with World(tmp_path, prepared=True) as world:
        world.start_tower()
        world.start_simulated("Kestrel", options=SIMULATOR)
        world.wait_until_online(world.visitor("admin"), 1)
        yield world


async def holds(watcher: Pilot, near_m: float, timeout_s: float = 10.0) -> None:
    """Altitude hold, level, and near where it was."""
    await watcher.until(lambda: watcher.mode == ALT_HOLD and watcher.altitude_m > 0, "altitude hold", timeout_s)
    await watcher.until(lambda: max(map(abs, watcher.roll_pitch_rad)) < 0.1, "level", 5.0)
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
        # The lease stays for the grace time: alice can come back and fly on.
        drone = await asyncio.to_thread(alice.drone, 1)
        assert drone["holder"]["name"] == "alice"
        assert any(event["type"] == "hold" and event["step"] == "confirmed" for event in watcher.events)


async def test_the_tower_dies(world: World) -> None:
    alice = world.visitor("alice")
    async with at_the_controls(alice, 1) as pilot:
        await fly_by_hand(pilot)
        pilot.hold_sticks(roll=-500)
        await pilot.until(lambda: abs(pilot.roll_pitch_rad[0]) > 0.1, "leaning")
        height_m, epoch = pilot.altitude_m, (await asyncio.to_thread(alice.drone, 1))["epoch"]
        await asyncio.to_thread(kill_9, world.tower)
    # The agent holds by itself; nobody else is left to say so.
    await asyncio.to_thread(
        wait_for, "the agent's own hold", lambda: "hold: confirmed" in world.log_of("agent-Kestrel")
    )
    await asyncio.to_thread(world.start_tower)
    await asyncio.to_thread(world.wait_until_online, world.visitor("admin"), 1)
    async with watching(world.visitor("admin"), 1) as watcher:
        await watcher.until(lambda: watcher.mode != -1, "a heartbeat")
        await holds(watcher, height_m)
    drone = await asyncio.to_thread(alice.drone, 1)
    assert (drone["holder"]["name"], drone["epoch"]) == ("alice", epoch)


async def test_the_agent_dies(world: World) -> None:
    """Then nobody is left beside the autopilot: its own failsafe acts, and the tower says offline."""
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
        # systemd would start it again; the lease is as it was, and the drone is flown on.
        await asyncio.to_thread(world.restart, "agent-Kestrel")
        await asyncio.to_thread(world.wait_until_online, admin, 1)
        pilot.hold_sticks()
        await pilot.set_mode(5)
        await pilot.until(lambda: pilot.armed and pilot.climb_mps > -0.3, "flown on")
