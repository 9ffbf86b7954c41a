"""Controllers on board fly a real ArduCopter, through a real tower and agent. What counts is seen at its port."""

import asyncio
import math
import os
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from real.beside_agents import PhotographedTap, beside_agents
from worlds.controllers import PACER, controller_process
from worlds.free_ports import free_udp_ports
from worlds.pilot import Pilot, at_the_controls
from worlds.processes import World

from bench.rig import HOME

HOLDS_WITHIN_S = 0.5
SCRIPT_HEIGHT_M = 10.0


@dataclass
class Scene:
    world: World
    tap: PhotographedTap
    file: Path

    def process(self) -> int | None:
        return controller_process(self.world.running("agent-Kestrel").pid)

    async def starts(self, pilot: Pilot) -> str:
        """Returns the id of the operation once set-points go out."""
        before = len(self.tap.setpoints)
        begun = await pilot.ask("POST", "/controller", {"controller": "pacer"})
        assert begun.status == 202, begun.body
        await pilot.until(lambda: len(self.tap.setpoints) > before + 40, "set-points")
        identity: str = begun.json["id"]
        return identity

    async def ended(self, pilot: Pilot, operation: str) -> Any:
        def end() -> Any:
            changes = [one["operation"] for one in pilot.events if one["type"] == "operation"]
            return [one for one in changes if one["id"] == operation and one["state"] != "running"]

        await pilot.until(lambda: bool(end()), "the end of the operation", 180.0)
        return end()[-1]

    async def hold_after(self, pilot: Pilot, at_s: float) -> float:
        """Returns when the first request of a mode after `at_s` came to the autopilot, s."""

        def first() -> float | None:
            return next((at for at in list(self.tap.mode_requests) if at >= at_s), None)

        await pilot.until(lambda: first() is not None, "a request of a mode", 5.0)
        found = first()
        assert found is not None
        return found - at_s

    def setpoints_since(self, at_s: float) -> list[float]:
        return [at for at in list(self.tap.setpoints) if at > at_s]


@pytest.fixture
def scene(arducopter: Path, tmp_path: Path) -> Iterator[Scene]:
    file = tmp_path / "pacer.py"
    file.write_text(PACER)
    port = free_udp_ports(1)[0]
    with World(tmp_path / "world") as world, beside_agents(arducopter, tmp_path, {port: HOME}) as taps:
        world.add_user("alice")
        world.add_user("root", "admin")
        world.add_drone("Kestrel", "alice")
        world.start_tower()
        world.start_agent("Kestrel", f"udpin:127.0.0.1:{port}", "--controller", f"pacer={file}:Pacer")
        world.wait_until_online(world.visitor("alice"), 1)
        yield Scene(world, taps[0], file)


async def test_the_script_is_flown_from_the_ground_to_the_ground(scene: Scene) -> None:
    async with at_the_controls(scene.world.visitor("alice"), 1) as alice:
        await alice.until(lambda: alice.has_position, "a position")
        for _ in range(20):  # it may not be ready to arm yet
            begun = await alice.ask("POST", "/controller", {"controller": "scripted", "may_take_off": True})
            assert begun.status == 202, begun.body
            end = await scene.ended(alice, begun.json["id"])
            if end["state"] == "done" or "arming" not in end["words"]:
                break
            await asyncio.sleep(0.5)
        flown = list(scene.tap.motions)
        far_m = max(math.hypot(one.north_m, one.east_m) for one in flown)
        high_m, fast_mps = max(one.alt_m for one in flown), max(one.speed_mps for one in flown)
        print(f"{end['state']}: {end['words']}; {far_m:.1f} m away, {high_m:.1f} m high, {fast_mps:.1f} m/s at most")
        assert end["state"] == "done", end
        assert "has landed it" in end["words"]
        assert not alice.armed
        assert 7.0 < far_m < 13.0  # four legs of 8 m: the far corner is 11.3 m away
        assert scene.process() is None


async def test_each_way_to_fail_leads_to_a_hold(scene: Scene) -> None:
    def raises() -> None:
        scene.file.with_suffix(".raise").touch()

    def sends(number: signal.Signals) -> Callable[[], None]:
        def send() -> None:
            pid = scene.process()
            assert pid is not None
            os.kill(pid, number)

        return send

    ways = {
        "hangs": sends(signal.SIGSTOP),
        "was killed by signal 9": sends(signal.SIGKILL),
        "failed: ValueError: told to": raises,
    }
    async with at_the_controls(scene.world.visitor("alice"), 1) as alice:
        await alice.take_off(15.0)
        for words, fail in ways.items():
            operation = await scene.starts(alice)
            failed_at = time.monotonic()
            fail()
            end = await scene.ended(alice, operation)
            held_s = await scene.hold_after(alice, failed_at)
            await asyncio.sleep(4.0)  # set-points that must not come, and the time in which it stops
            speed_mps = scene.tap.motions[-1].speed_mps
            print(
                f"{words}: hold after {held_s * 1000:.0f} ms at its port, {speed_mps:.2f} m/s 4 s later; {end['words']}"
            )
            assert held_s <= HOLDS_WITHIN_S
            assert end["state"] == "failed"
            assert words in end["words"]
            assert "It holds in" in end["words"]
            assert scene.setpoints_since(failed_at + held_s) == []
            assert speed_mps < 0.5
            assert scene.process() is None


async def test_a_slow_controller_is_flown_at_20_hz_until_a_take(scene: Scene) -> None:
    async with at_the_controls(scene.world.visitor("alice"), 1) as alice:
        await alice.take_off(15.0)
        operation = await scene.starts(alice)
        began_at = time.monotonic()
        await asyncio.sleep(6.0)
        times = scene.setpoints_since(began_at)
        rate_hz = (len(times) - 1) / (times[-1] - times[0])
        gap_s = max(later - earlier for earlier, later in pairwise(times))
        print(
            f"{rate_hz:.2f} set-points/s, longest gap {gap_s * 1000:.0f} ms, {scene.tap.motions[-1].speed_mps:.2f} m/s"
        )
        assert 19.5 < rate_hz < 20.5
        assert 0.8 < scene.tap.motions[-1].speed_mps < 1.2

        root = scene.world.visitor("root")
        taken_at = time.monotonic()
        taken = await asyncio.to_thread(root.ask, "POST", "/drones/1/control/take", {})
        assert taken.status == 200, taken.body
        held_s = await scene.hold_after(alice, taken_at)
        await asyncio.sleep(2.0)  # set-points that must not come
        late = scene.setpoints_since(taken_at + held_s)
        print(f"TAKE: hold after {held_s * 1000:.0f} ms, {len(late)} set-points after it")
        assert late == []
        assert (await scene.ended(alice, operation))["state"] != "done"
        assert scene.process() is None
