"""A drone follows the person at a browser, with real programs: tower, agent, simulated drone. The test plays the
browser, and walks."""

import asyncio
import json
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from math import cos, radians
from pathlib import Path
from typing import Any, Final

import pytest
from worlds.pilot import Pilot, at_the_controls, watching
from worlds.processes import Visitor, World

from server.airspace.core.separation.motion import METRES_PER_DEGREE

pytestmark = pytest.mark.long("flown from a browser by e2e/test_follow_on_the_console.py")

BRAKE: Final = 17
HEIGHT_M: Final = 12.0
AWAY_M: Final = 15.0


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    with World(tmp_path) as world:
        for name in ("alice", "bob"):
            world.add_user(name)
        assert world.add_drone("Kestrel", "alice", "bob") == 1
        world.start_tower()
        world.start_simulated("Kestrel", options=("--boot-s", "1", "--seed", "3", "--speed", "1"))
        world.wait_until_online(world.visitor("alice"), 1)
        yield world


class Person:
    """Walks, and sends a position once a second over the pilot's live channel."""

    def __init__(self, pilot: Pilot) -> None:
        self._pilot = pilot
        self.lat, self.lon = pilot.place_deg[0] - 30.0 / METRES_PER_DEGREE, pilot.place_deg[1]
        self.accuracy_m = 4.0
        self.is_silent = False

    def request(self, **changes: Any) -> dict[str, Any]:
        place = {"lat": self.lat, "lon": self.lon, "accuracy_m": self.accuracy_m}
        return {"command": "follow_me", "distance_m": AWAY_M} | place | changes

    def text(self) -> str:
        fix = {"drone_id": 1, "lat": self.lat, "lon": self.lon, "accuracy_m": self.accuracy_m, "age_ms": 100.0}
        return json.dumps({"type": "person_fix", "sent_ms": int(time.monotonic() * 1000) % 2**32} | fix)

    async def reports(self) -> None:
        while True:
            if not self.is_silent:
                await self._pilot.say(self.text())
            await asyncio.sleep(1.0)

    def seen(self) -> tuple[float, float]:
        """Returns the drone's position, metres north and east."""
        lat, lon = self._pilot.place_deg
        north = (lat - self.lat) * METRES_PER_DEGREE
        return north, (lon - self.lon) * METRES_PER_DEGREE * cos(radians(lat))

    def drone_is_in_place(self) -> bool:
        north, east = self.seen()
        return abs(north - AWAY_M) < 2 and abs(east) < 2 and abs(self._pilot.altitude_m - HEIGHT_M) < 1.0


@asynccontextmanager
async def followed(visitor: Visitor) -> AsyncIterator[tuple[Pilot, Person, str]]:
    """A person followed by their drone, 15 m to their north, and the operation's id."""
    async with at_the_controls(visitor, 1) as pilot:
        await pilot.take_off(HEIGHT_M)
        person = Person(pilot)
        begun = await pilot.ask("POST", "/commands", person.request())
        assert begun.status == 202, begun.body
        assert (begun.json["work"], begun.json["state"]) == ("follow_me", "running")
        reporting = asyncio.create_task(person.reports())
        try:
            await pilot.until(person.drone_is_in_place, "its place")
            yield pilot, person, begun.json["id"]
        finally:
            reporting.cancel()


async def end_of(visitor: Visitor, operation_id: str) -> Any:
    deadline = time.monotonic() + 20.0
    while time.monotonic() < deadline:
        answer = (await asyncio.to_thread(visitor.ask, "GET", f"/operations/{operation_id}")).json
        if answer["state"] != "running":
            return answer
        await asyncio.sleep(0.1)
    raise AssertionError(f"it still runs: {answer}")


async def test_it_follows_a_person_who_walks_and_holds_when_nothing_is_heard_of_them(world: World) -> None:
    visitor = world.visitor("alice")
    async with followed(visitor) as (pilot, person, operation_id):
        begins = person.lat
        for _ in range(8):  # 1.5 m/s, away from the drone
            person.lat -= 1.5 / METRES_PER_DEGREE
            await asyncio.sleep(1.0)
            north, _ = person.seen()
            assert 9.0 < north < 25.0, "neither near nor lost"
        assert (begins - person.lat) * METRES_PER_DEGREE == pytest.approx(12.0)
        await pilot.until(person.drone_is_in_place, "its place, 12 m further on")
        # Inaccurate positions count as none.
        person.accuracy_m = 35.0
        person.lat -= 5.0 / METRES_PER_DEGREE
        answer = await end_of(visitor, operation_id)
        assert answer["state"] == "failed"
        assert answer["words"] == (
            "Kestrel: It no longer follows alice: nothing new was heard of alice for 3 s. It holds in BRAKE."
        )
        await pilot.until(lambda: pilot.mode == BRAKE, "BRAKE")
        north, _ = person.seen()
        assert north > AWAY_M + 2.0, "it went nowhere by what was not sure"


async def test_the_browser_that_goes_takes_it_along_and_so_do_other_commands(world: World) -> None:
    visitor = world.visitor("alice")
    async with followed(visitor) as (_, _, operation_id):
        pass
    answer = await end_of(world.visitor("bob"), operation_id)
    assert answer["state"] == "cancelled"
    assert answer["words"].startswith("Kestrel: the browser of alice is gone.")
    assert answer["words"].endswith("It holds in BRAKE.")


async def test_another_command_ends_it_and_is_not_disturbed(world: World) -> None:
    visitor = world.visitor("alice")
    async with followed(visitor) as (pilot, person, operation_id):
        assert (await pilot.ask("POST", "/commands", {"command": "hold"})).json["state"] == "done"
        answer = await end_of(visitor, operation_id)
        assert answer["state"] == "failed"
        assert "a hold or another command came" in answer["words"]
        stands = pilot.place_deg
        person.lat -= 10.0 / METRES_PER_DEGREE
        await pilot.until(lambda: pilot.mode == BRAKE, "BRAKE")
        refused = await pilot.ask("POST", "/commands", person.request(accuracy_m=16.0))
        assert refused.status == 409
        assert "accurate to 16 m only" in refused.json["detail"]
        assert abs(pilot.place_deg[0] - stands[0]) * METRES_PER_DEGREE < 3.0


async def test_nobody_elses_browser_moves_the_drone(world: World) -> None:
    visitor = world.visitor("alice")
    async with followed(visitor) as (pilot, person, _), watching(world.visitor("bob"), 1) as bob:
        stranger = Person(pilot)
        stranger.lat, stranger.lon = person.lat + 8.0 / METRES_PER_DEGREE, person.lon
        for _ in range(3):
            await bob.say(stranger.text())
            await asyncio.sleep(0.5)
        assert person.drone_is_in_place()
