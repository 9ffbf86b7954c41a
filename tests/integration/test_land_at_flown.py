"""A drone flies to a place and lands there, with real programs; a hold on the way keeps it in the air."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
from test_work_flown import flying, loss_parameters
from worlds.pilot import Pilot
from worlds.processes import World

from server.airspace.core.separation.motion import METRES_PER_DEGREE

HEIGHT_M = 12.0
WAY_M = 40.0


@pytest.fixture
def world(tmp_path: Path) -> Any:
    """Kestrel belongs to alice."""
    with World(tmp_path) as world:
        world.add_user("alice")
        assert world.add_drone("Kestrel", "alice") == 1
        world.start_tower()
        yield world


async def take_off(pilot: Pilot) -> None:
    await loss_parameters(pilot)
    await pilot.accept_loss_check()
    async with asyncio.timeout(60):
        while True:
            answer = await pilot.ask("POST", "/commands", {"command": "takeoff", "height_m": HEIGHT_M})
            if answer.status != 409 or answer.json["type"] != "/problems/not-known-yet":
                break
            await asyncio.sleep(0.2)
    assert answer.json["state"] == "done", answer.json
    await pilot.until(lambda: pilot.altitude_m > HEIGHT_M - 1, "its height")


async def begin(pilot: Pilot) -> tuple[Any, float]:
    """Sends it 40 m north, to land there. Returns the operation and the latitude."""
    lat, lon = pilot.place_deg
    there = lat + WAY_M / METRES_PER_DEGREE
    body = {"command": "land_at", "lat": there, "lon": lon, "height_m": HEIGHT_M}
    begun = await pilot.ask("POST", "/commands", body)
    assert begun.status == 202, begun.body
    assert (begun.json["work"], begun.json["state"]) == ("land_at", "running")
    return begun.json, there


async def ended(world: World, pilot: Pilot, operation: Any) -> Any:
    """The operation, once it is over."""
    visitor = world.visitor("alice")
    async with asyncio.timeout(90):
        while True:
            now = (await asyncio.to_thread(visitor.ask, "GET", f"/operations/{operation['id']}")).json
            if now["state"] != "running":
                return now
            await asyncio.sleep(0.2)


def north_m(pilot: Pilot, lat: float) -> float:
    return (pilot.place_deg[0] - lat) * METRES_PER_DEGREE


@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
async def test_it_lands_at_the_place(world: World, flavour: str) -> None:
    async with flying(world, "--flavour", flavour) as pilot:
        await take_off(pilot)
        operation, there = await begin(pilot)
        assert (await ended(world, pilot, operation))["state"] == "done"
        assert abs(north_m(pilot, there)) < 4
        await pilot.until(lambda: pilot.altitude_m < 0.5, "the ground", timeout_s=60)
        assert abs(north_m(pilot, there)) < 4
        phases = [one["operation"]["phase"] for one in pilot.events if one["type"] == "operation"]
        assert any(phase.startswith("on the way there, ") for phase in phases)


async def test_a_hold_on_the_way_keeps_it_in_the_air(world: World) -> None:
    async with flying(world) as pilot:
        await take_off(pilot)
        operation, there = await begin(pilot)
        await pilot.until(lambda: north_m(pilot, there) > -WAY_M + 5, "it to be on its way")
        assert (await pilot.ask("POST", "/commands", {"command": "hold"})).json["state"] == "done"
        over = await ended(world, pilot, operation)
        assert (over["state"], over["words"]) == (
            "cancelled",
            "It was stopped before this step: landing there. A hold or another command came.",
        )
        assert pilot.altitude_m > HEIGHT_M - 2
