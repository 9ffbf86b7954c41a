"""Each way to reach an autopilot: the agent as a process, on uvloop, uploads a mission and starts it.

Over UDP and over a cable it is flown to its end. The programs on the cable are the installed ones.
"""

import asyncio
import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from worlds.free_ports import free_tcp_port, free_udp_ports
from worlds.pilot import Pilot, at_the_controls
from worlds.processes import World
from worlds.serial_cable import SerialCable

WAYPOINT, TAKE_OFF, RETURN = 16, 22, 20
LAT_E7, LON_E7 = 473977000, 85456000
AUTO = 3
FLOWN_TO_THE_END = ("udpin", "serial")
OTHER_END = pytest.mark.long("the other end of a port that is flown; test_agent_ports.py opens it")
MISSION = [
    [TAKE_OFF, 3, [0, 0, 0, 0], 0, 0, 12, 1],
    [WAYPOINT, 3, [0, 0, 0, 0], LAT_E7 + 1500, LON_E7, 15, 1],
    [WAYPOINT, 3, [0, 0, 0, 0], LAT_E7 + 1500, LON_E7 + 2000, 15, 1],
    [RETURN, 3, [0, 0, 0, 0], 0, 0, 0, 1],
]


@pytest.fixture
def world(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[World]:
    """Kestrel belongs to alice."""
    with World(tmp_path, as_installed=request.node.callspec.params["port"] == "serial") as world:
        world.add_user("alice")
        assert world.add_drone("Kestrel", "alice") == 1
        world.start_tower()
        yield world


def simulator(world: World, out: str) -> None:
    options = ("--home", "47.3977,8.5456,488,0", "--boot-s", "1", "--speed", "4", "--real-rates", "--out", out)
    world.start("simulator", "tower-sim", *options)


@pytest.fixture
def port(world: World, request: pytest.FixtureRequest) -> Iterator[str]:
    """Runs the agent and an autopilot at the two ends of this transport."""
    udp, tcp = free_udp_ports(1)[0], free_tcp_port()
    ends = {
        "udpin": (f"udpin:127.0.0.1:{udp}", f"udp:127.0.0.1:{udp}"),
        "udpout": (f"udpout:127.0.0.1:{udp}", f"udpin:127.0.0.1:{udp}"),
        "tcp": (f"tcp:127.0.0.1:{tcp}", f"tcpin:127.0.0.1:{tcp}"),
        "tcpin": (f"tcpin:127.0.0.1:{tcp}", f"tcp:127.0.0.1:{tcp}"),
        "serial": ("", f"tcpin:127.0.0.1:{tcp}"),
    }
    agents, autopilots = ends[request.param]
    simulator(world, autopilots)
    cable = SerialCable(tcp) if request.param == "serial" else None
    world.start_agent("Kestrel", f"serial:{cable.device}:115200" if cable else agents)
    yield request.param
    if cable is not None:
        cable.unplug()


async def commanded(pilot: Pilot, command: dict[str, Any]) -> None:
    """Runs a command once its preconditions are known, such as the position of home."""
    for _ in range(300):
        done = await pilot.ask("POST", "/commands", command)
        if done.status != 409 or done.json["type"] != "/problems/not-known-yet":
            break
        await asyncio.sleep(0.1)
    assert (done.status, done.json.get("state")) == (200, "done"), done.body


@pytest.mark.parametrize(
    "port",
    [
        "udpin",
        pytest.param("udpout", marks=OTHER_END),
        "tcp",
        pytest.param("tcpin", marks=OTHER_END),
        "serial",
    ],
    indirect=True,
)
async def test_a_port_carries_a_mission(world: World, port: str) -> None:
    assert importlib.util.find_spec("uvloop"), f"{port} is to be tried on the loop that is installed"
    alice = world.visitor("alice")
    await asyncio.to_thread(world.wait_until_online, alice, 1)
    async with at_the_controls(alice, 1) as pilot:
        await pilot.until(lambda: pilot.has_position, "a position")
        put = await pilot.ask("PUT", "/mission", {"items": MISSION})
        assert (put.status, put.json["state"]) == (200, "done"), put.body
        fresh = (await pilot.ask("GET", "/mission?fresh=true")).json
        assert (fresh["state"], fresh["count"]) == ("known", len(MISSION))
        await pilot.accept_loss_check()
        for command in ({"command": "takeoff", "height_m": 10}, {"command": "start"}):
            await commanded(pilot, command)
            await pilot.until(lambda: pilot.altitude_m > 8, "the air")
        await pilot.until(lambda: pilot.mode == AUTO, "AUTO")
        if port in FLOWN_TO_THE_END:
            await pilot.until(lambda: pilot.place_deg[1] > (LON_E7 + 1800) / 1e7, "the second way-point", 60.0)
            await pilot.until(lambda: not pilot.armed, "the landing at home", 120.0)
    assert "Traceback" not in world.log_of("agent-Kestrel")
