"""A drone follows another one, with real programs: tower, two agents, two simulated drones."""

import asyncio
from collections.abc import Iterator
from math import cos, radians
from pathlib import Path
from typing import Any

import pytest
from worlds.pilot import Pilot, at_the_controls
from worlds.processes import World

from server.airspace.core.separation.motion import METRES_PER_DEGREE

BRAKE = 17
HEIGHT_M = 12.0


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    """Kestrel belongs to alice, Merlin to alice and bob."""
    with World(tmp_path) as world:
        for name in ("alice", "bob"):
            world.add_user(name)
        assert world.add_drone("Kestrel", "alice") == 1
        assert world.add_drone("Merlin", "alice", "bob") == 2
        world.start_tower()
        world.start_simulated("Kestrel", "Merlin", options=("--boot-s", "1", "--seed", "3", "--speed", "1"))
        world.wait_until_online(world.visitor("alice"), 1, 2)
        yield world


def seen_from(leader: Pilot, follower: Pilot) -> tuple[float, float]:
    """Returns metres north and east."""
    (lat, lon), (other_lat, other_lon) = leader.place_deg, follower.place_deg
    north = (other_lat - lat) * METRES_PER_DEGREE
    return north, (other_lon - lon) * METRES_PER_DEGREE * cos(radians(lat))


async def test_it_keeps_its_place_until_it_is_told_to_stop(world: World) -> None:
    async with (
        at_the_controls(world.visitor("alice"), 1) as alice,
        at_the_controls(world.visitor("bob"), 2) as bob,
    ):
        await asyncio.gather(alice.take_off(HEIGHT_M), bob.take_off(HEIGHT_M))
        begun = await alice.ask("POST", "/commands", {"command": "follow", "leader": 2, "north_m": -14, "up_m": 3})
        assert begun.status == 202, begun.body
        assert (begun.json["work"], begun.json["state"]) == ("follow", "running")

        def in_place() -> bool:
            north, east = seen_from(bob, alice)
            return abs(north + 14) < 2 and abs(east) < 2 and abs(alice.altitude_m - bob.altitude_m - 3) < 1

        await alice.until(in_place, "its place")
        lat, lon = bob.place_deg
        body: dict[str, Any] = {"command": "goto", "lat": lat + 40 / METRES_PER_DEGREE, "lon": lon, "height_m": 15}
        assert (await bob.ask("POST", "/commands", body)).json["state"] == "done"
        await bob.until(lambda: (bob.place_deg[0] - lat) * METRES_PER_DEGREE > 38, "40 m further on")
        await alice.until(in_place, "its place, 40 m further on")
        phases = [one["operation"]["phase"] for one in alice.events if one["type"] == "operation"]
        assert any(phase.startswith("following Merlin: ") for phase in phases)

        visitor = world.visitor("alice")
        stopped = await asyncio.to_thread(visitor.ask, "DELETE", f"/operations/{begun.json['id']}")
        assert stopped.status == 202, stopped.body
        await alice.until(lambda: alice.mode == BRAKE, "BRAKE")

        def ended() -> Any:
            return visitor.ask("GET", f"/operations/{begun.json['id']}").json

        answer = await asyncio.to_thread(ended)
        for _ in range(50):
            if answer["state"] != "running":
                break
            await asyncio.sleep(0.1)
            answer = await asyncio.to_thread(ended)
        assert answer["state"] == "cancelled"
        assert answer["words"] == "Kestrel: It was ordered to stop following Merlin. It holds in BRAKE."
