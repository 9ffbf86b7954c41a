"""Two drones of different owners fly at each other: both pilots are warned in time, and neither learns the other's
identity.
"""

import asyncio
from collections.abc import Iterator
from math import cos, hypot, radians
from pathlib import Path
from typing import Any

import pytest
from worlds.pilot import Pilot, at_the_controls, watching
from worlds.processes import World

from server.airspace.core.separation.motion import METRES_PER_DEGREE
from wire.dialect import mavlink

HEIGHT_M = 15.0
BOUND_M = 15.0
WARNED_M = 7.5
"""The defaults of docs/settings.md."""


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    """Kestrel belongs to alice, Merlin to bob; they stand 20 m apart, beyond the watch's limit."""
    with World(tmp_path) as world:
        for name, role in (("alice", "operator"), ("bob", "operator"), ("admin", "admin")):
            world.add_user(name, role)
        assert world.add_drone("Kestrel", "alice") == 1
        assert world.add_drone("Merlin", "bob") == 2
        world.start_tower()
        # Not faster than real: the watch cannot predict a drone whose position does not match its speed.
        world.start_simulated("Kestrel", "Merlin", options=("--boot-s", "1", "--seed", "3", "--speed", "1"))
        world.wait_until_online(world.visitor("admin"), 1, 2)
        yield world


def reported(pilot: Pilot) -> list[dict[str, Any]]:
    return [event for event in pilot.events if event["type"] == "separation"]


def levels(pilot: Pilot) -> list[str]:
    """Returns the levels, without immediate repetitions."""
    found: list[str] = []
    for event in reported(pilot):
        if found[-1:] != [event["level"]]:
            found.append(event["level"])
    return found


def apart_m(one: Pilot, other: Pilot) -> float:
    (lat, lon), (other_lat, other_lon) = one.place_deg, other.place_deg
    north = (other_lat - lat) * METRES_PER_DEGREE
    return hypot(north, (other_lon - lon) * METRES_PER_DEGREE * cos(radians(lat)))


async def go_to(pilot: Pilot, lat_deg: float, lon_deg: float, height_m: float = HEIGHT_M) -> None:
    frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
    place = (round(lat_deg * 1e7), round(lon_deg * 1e7), height_m)
    number = mavlink.MAV_CMD_DO_REPOSITION
    await pilot.send(mavlink.MAVLink_command_int_message(1, 1, frame, number, 0, 0, -1, 1, 0, float("nan"), *place))


async def test_two_drones_flown_at_each_other(world: World) -> None:
    async with (
        at_the_controls(world.visitor("alice"), 1) as alice,
        at_the_controls(world.visitor("bob"), 2) as bob,
        watching(world.visitor("admin"), 1) as admin,
    ):
        await asyncio.gather(alice.take_off(HEIGHT_M), bob.take_off(HEIGHT_M))
        assert apart_m(alice, bob) == pytest.approx(20, abs=2)
        assert reported(alice) == reported(bob) == reported(admin) == []

        (lat, lon), (other_lat, other_lon) = alice.place_deg, bob.place_deg
        # Away from Merlin first, to make room for a flight towards it.
        await go_to(alice, lat - 3 * (other_lat - lat), lon - 3 * (other_lon - lon))
        await alice.until(lambda: apart_m(alice, bob) > 70, "60 m of run-up")
        assert reported(alice) == []

        await go_to(alice, other_lat, other_lon)
        await alice.until_event("separation", level="caution")
        assert apart_m(alice, bob) > BOUND_M  # before they are near, not when
        await asyncio.gather(*(one.until_event("separation", level="warning") for one in (alice, bob, admin)))
        assert apart_m(alice, bob) > WARNED_M

        assert {tuple(event["drones"]) for event in reported(alice)} == {(1, None)}
        assert {tuple(event["drones"]) for event in reported(bob)} == {(2, None)}
        assert {tuple(event["drones"]) for event in reported(admin)} == {(1, 2)}
        seen = next(event for event in reported(alice) if event["level"] == "warning")
        seen_back = next(event for event in reported(bob) if event["level"] == "warning")
        assert (seen["bearing_deg"] - seen_back["bearing_deg"]) % 360 == pytest.approx(180, abs=30)
        assert "Merlin" not in str(reported(alice)) and "Kestrel" not in str(reported(bob))

        await go_to(bob, other_lat, other_lon, HEIGHT_M + 25)
        for one in (alice, bob, admin):
            end = await one.until_event("separation", level="clear")
            assert end["why"] == ("apart" if one is admin else "")
            assert levels(one)[-1] == "clear"
            # An admin also receives the ends of strangers' warnings, because an admin may have become a stranger
            # meanwhile.
            assert len({event["number"] for event in reported(one) if event["level"] != "clear"}) == 1

        def audited() -> list[dict[str, Any]]:
            answer = world.visitor("admin").ask("GET", "/audit?action=separation.warning")
            return list(answer.json)

        (written,) = await asyncio.to_thread(audited)
        assert (written["drone"]["id"] if "drone" in written else written["drone_id"]) == 1
        assert written["detail"]["other_id"] == 2
