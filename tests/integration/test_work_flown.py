"""Plans, parameters, commands and logs over REST with real programs: tower, agent and simulator, flown."""

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from worlds.pilot import Pilot, at_the_controls
from worlds.processes import World, wait_for

from server.control.core.loan_limits import Home

WAYPOINT, TAKE_OFF, RETURN = 16, 22, 20
LAT_E7, LON_E7 = 473977000, 85456000
RTL, GUIDED, AUTO, BRAKE = 6, 4, 3, 17
PX4_LOITER, PX4_MISSION, PX4_ORBIT = 4 << 16 | 3 << 24, 4 << 16 | 4 << 24, 3 << 16 | 1 << 24


def mission(count: int) -> list[list[Any]]:
    """Returns a take-off, a line of way-points 20 m apart, and the return home."""
    line = [[WAYPOINT, 3, [0, 0, 0, None], LAT_E7 + number * 1800, LON_E7, 30, 1] for number in range(1, count - 1)]
    return [[TAKE_OFF, 3, [0, 0, 0, None], LAT_E7, LON_E7, 20, 1], *line, [RETURN, 3, [0, 0, 0, 0], 0, 0, 0, 1]]


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    """Kestrel belongs to alice."""
    with World(tmp_path) as world:
        world.add_user("alice")
        assert world.add_drone("Kestrel", "alice") == 1
        world.start_tower()
        yield world


@asynccontextmanager
async def flying(world: World, *options: str) -> AsyncIterator[Pilot]:
    world.start_simulated("Kestrel", options=("--boot-s", "1", "--speed", "4", "--real-rates", *options))
    alice = world.visitor("alice")
    # Its position may arrive a second before its first heartbeat, and the work waits for the heartbeat.
    await asyncio.to_thread(wait_for, "the autopilot to be heard", lambda: alice.drone(1).get("autopilot_heard"))
    async with at_the_controls(alice, 1) as pilot:
        await pilot.until(lambda: pilot.has_position, "a position")
        yield pilot


async def work(pilot: Pilot, method: str, path: str, body: Any = None, *, state: str = "done") -> Any:
    """Runs an operation that ends in this state."""
    answer = await pilot.ask(method, path, body)
    assert answer.status == 200, answer.body
    assert answer.json["state"] == state, answer.json["words"]
    return answer.json


async def command(pilot: Pilot, command_: str, **body: Any) -> Any:
    return await work(pilot, "POST", "/commands", {"command": command_} | body)


async def refusal(pilot: Pilot, command_: str, **body: Any) -> Any:
    """Returns the problem with a command, once its preconditions are known, such as the position of home."""
    for _ in range(300):
        answer = await pilot.ask("POST", "/commands", {"command": command_} | body)
        assert answer.status == 409, answer.body
        if answer.json["type"] != "/problems/not-known-yet":
            return answer.json
        await asyncio.sleep(0.1)
    raise AssertionError(answer.body)


async def loss_parameters(pilot: Pilot) -> None:
    """Waits until the tower knows what the autopilot does when somebody is lost."""
    for _ in range(300):
        if (await pilot.ask("GET", "/loss-check")).json["complete"]:
            return
        await asyncio.sleep(0.1)
    raise AssertionError("the autopilot's failsafes were not read")


async def parameters(pilot: Pilot) -> dict[str, float]:
    """Returns the parameters once they are known."""
    for _ in range(300):
        answer = await pilot.ask("GET", "/parameters")
        if answer.status == 200:
            return {one["name"]: one["value"] for one in answer.json["values"]}
        await asyncio.sleep(0.1)
    raise AssertionError(answer.body)


async def is_near(pilot: Pilot, lat: float, lon: float) -> None:
    await pilot.until(lambda: Home(*pilot.place_deg, 0).distance_m(lat, lon) < 3.0, f"{lat}, {lon}")


async def test_a_copter_is_told_all_of_it_and_does_it(world: World) -> None:
    async with flying(world, "--param-count", "1400") as pilot:
        items = mission(200)
        put = await work(pilot, "PUT", "/mission", {"items": items})
        fresh = (await pilot.ask("GET", "/mission?fresh=true")).json
        assert (fresh["state"], fresh["count"]) == ("known", 200)
        assert put["hash"] in (fresh["hash"], fresh["sent_hash"])
        await work(pilot, "POST", "/mission/verify", {"items": items})
        assert (await work(pilot, "POST", "/mission/verify", {"items": items[:-1]}, state="failed"))["words"]

        known = await parameters(pilot)
        assert len(known) >= 1390
        height_cm = known["RTL_ALT"] + 500
        written = await work(
            pilot, "PATCH", "/parameters", {"values": {"RTL_ALT": height_cm, "NO_SUCH": 1}}, state="failed"
        )
        assert [(one["name"], one["asked"]) for one in written["refusals"]] == [("NO_SUCH", 1.0)]
        assert (await parameters(pilot))["RTL_ALT"] == height_cm

        refused = await pilot.ask("POST", "/commands", {"command": "disarm", "force": False})
        assert refused.json["state"] == "done"
        await pilot.accept_loss_check()
        await command(pilot, "takeoff", height_m=15)
        await pilot.until(lambda: abs(pilot.altitude_m - 15) < 1, "15 m")
        assert pilot.mode == GUIDED
        await command(pilot, "goto", lat=47.3980, lon=8.5456, height_m=25, speed_m_s=8)
        await is_near(pilot, 47.3980, 8.5456)
        falls = await pilot.ask("POST", "/commands", {"command": "disarm"})
        assert falls.json["type"] == "/problems/would-fall"
        await command(pilot, "turn", deg=90)
        await command(pilot, "roi", lat=47.3977, lon=8.5456, height_m=0)
        await command(pilot, "roi", none=True)
        await command(pilot, "start", item=2)
        await pilot.until(lambda: pilot.mode == AUTO, "AUTO")
        await command(pilot, "pause")
        await command(pilot, "resume")
        await command(pilot, "jump", item=5)
        await command(pilot, "hold")
        await pilot.until(lambda: pilot.mode == BRAKE, "BRAKE")
        await command(pilot, "resume")
        await pilot.until(lambda: pilot.mode == AUTO, "AUTO again")
        await command(pilot, "rtl")
        await pilot.until(lambda: not pilot.armed, "the landing", 90.0)

        logs = (await work(pilot, "POST", "/logs/list"))["logs"]
        newest = logs[0]
        await work(pilot, "POST", f"/logs/{newest['id']}/fetch")
        file = await pilot.ask("GET", f"/logs/{newest['id']}/file")
        assert len(file.body) == newest["size_bytes"] > 0


async def test_a_px4_is_told_all_of_it_and_does_it(world: World) -> None:
    async with flying(world, "--flavour", "px4", "--param", "NAV_RCL_ACT=0") as pilot:
        items = [*mission(12)[:-1], [RETURN, 2, [0, 0, 0, 0], 0, 0, 0, 1]]
        await work(pilot, "PUT", "/mission", {"items": items})
        # With this parameter it would drop or lose the drone.
        await loss_parameters(pilot)
        refused = await refusal(pilot, "takeoff", height_m=15)
        assert refused["type"] == "/problems/loss-check"
        assert (await pilot.ask("POST", "/loss-check/acknowledge", {"drone": "Kestrel"})).status == 200
        await command(pilot, "takeoff", height_m=15)
        await pilot.until(lambda: abs(pilot.altitude_m - 15) < 1 and pilot.mode == PX4_LOITER, "15 m")
        await command(pilot, "goto", lat=47.3980, lon=8.5456, height_m=25, speed_m_s=8)
        await is_near(pilot, 47.3980, 8.5456)
        await pilot.until(lambda: abs(pilot.altitude_m - 25) < 1, "25 m")
        await command(pilot, "turn", deg=90)
        await is_near(pilot, 47.3980, 8.5456)
        assert pilot.mode == PX4_LOITER
        await command(pilot, "orbit", lat=47.3980, lon=8.5456, radius_m=20, height_m=25, m_s=5)
        await pilot.until(lambda: pilot.mode == PX4_ORBIT, "the orbit's mode")
        home = Home(47.3980, 8.5456, 0)
        await pilot.until(lambda: abs(home.distance_m(*pilot.place_deg) - 20) < 2, "the orbit")
        await command(pilot, "start", item=3)
        await pilot.until(lambda: pilot.mode == PX4_MISSION, "the mission")
        await command(pilot, "jump", item=6)
        await command(pilot, "pause")
        await pilot.until(lambda: pilot.mode == PX4_LOITER, "the pause")
        await command(pilot, "resume")
        await pilot.until(lambda: pilot.mode == PX4_MISSION, "the mission again")
        await command(pilot, "rtl")
        await pilot.until(lambda: not pilot.armed, "the landing", 90.0)
        await command(pilot, "start")
        await pilot.until(lambda: pilot.armed and pilot.altitude_m > 5, "the mission from the ground")
        await command(pilot, "land")
