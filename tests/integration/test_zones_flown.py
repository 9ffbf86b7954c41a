"""A drone is flown by hand at a no-fly zone: its pilot is told, then it holds in front of it, and can be flown away."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from worlds.pilot import LOITER, Pilot, at_the_controls, fly_by_hand
from worlds.processes import Visitor, World, wait_for

from server.control.core.loan_limits import Home

EDGE_M = 60.0
DEEP_M = 200.0
FULL = 1000
DEGREE_M = 111_319.5


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    with World(tmp_path) as world:
        for name, role in (("alice", "operator"), ("admin", "admin")):
            world.add_user(name, role)
        assert world.add_drone("Kestrel", "alice") == 1
        world.start_tower()
        world.start_simulated("Kestrel", options=("--boot-s", "1", "--seed", "3"))
        world.wait_until_online(world.visitor("admin"), 1)
        yield world


def draw_around(admin: Visitor, home: Home) -> None:
    """Four no-fly zones, whose edges are 60 m from home on every side."""
    sides = {
        "North": (EDGE_M, DEEP_M, -DEEP_M, DEEP_M),
        "South": (-DEEP_M, -EDGE_M, -DEEP_M, DEEP_M),
        "East": (-EDGE_M, EDGE_M, EDGE_M, DEEP_M),
        "West": (-EDGE_M, EDGE_M, -DEEP_M, -EDGE_M),
    }
    for name, (south, north, west, east) in sides.items():
        corners = ((south, west), (south, east), (north, east), (north, west))
        points = [[home.lat_deg + up / DEGREE_M, home.lon_deg + along / _east_m(home)] for up, along in corners]
        answer = admin.ask("POST", "/zones", {"name": name, "kind": "no-fly", "points": points})
        assert answer.status == 201, answer.body


def _east_m(home: Home) -> float:
    return home.distance_m(home.lat_deg, home.lon_deg + 1.0)


def from_edge_m(home: Home, place: tuple[float, float]) -> float:
    """How far it is from the nearest edge; below 0 inside a zone."""
    north = abs(place[0] - home.lat_deg) * DEGREE_M
    east = abs(place[1] - home.lon_deg) * _east_m(home)
    return EDGE_M - max(north, east)


def alerts(pilot: Pilot, rule: str) -> list[dict[str, Any]]:
    told = [one["alert"] for one in pilot.events if one["type"] == "alert"]
    return [one for one in told if one["rule"] == rule]


async def at_rest(pilot: Pilot) -> None:
    """Until it has moved less than 20 cm in half a second."""
    for _ in range(60):
        before = Home(*pilot.place_deg, alt_amsl_m=0)
        await asyncio.sleep(0.5)
        if before.distance_m(*pilot.place_deg) < 0.2:
            return
    raise TimeoutError("it does not come to rest")


async def test_flown_at_a_zone_it_is_told_then_held_and_flies_away(world: World) -> None:
    admin = world.visitor("admin")
    async with at_the_controls(world.visitor("alice"), 1) as alice:
        await fly_by_hand(alice, 10.0)
        home = Home(*alice.place_deg, alt_amsl_m=0)
        await asyncio.to_thread(draw_around, admin, home)

        held = alice.confirmed_holds
        alice.hold_sticks(pitch=FULL)
        await alice.until(lambda: bool(alerts(alice, "zone-near")), "the alert before the zone")
        [near, *_] = alerts(alice, "zone-near")
        assert near["words"].startswith("Kestrel reaches the no-fly zone ")
        assert from_edge_m(home, alice.place_deg) > 10, "told before it is there"
        assert alice.confirmed_holds == held, "told before it is held"
        notice = await alice.until_event("notice", code="zone")
        assert notice["text"].startswith("Kestrel holds: at the edge of the no-fly zone ")
        await alice.until(lambda: alice.confirmed_holds > held, "the hold")
        await at_rest(alice)
        assert from_edge_m(home, alice.place_deg) > -1.0, "it stopped in front of the edge, stick forward"
        assert from_edge_m(home, alice.place_deg) < 40.0
        assert not [one for one in alerts(alice, "zone-breached") if one["closed_at"] is None]

        # A go-to into the zone is refused, and one home is not.
        inside = {"command": "goto", "lat": home.lat_deg + 100 / DEGREE_M, "lon": home.lon_deg, "height_m": 10}
        refused = await alice.ask("POST", "/commands", inside)
        assert refused.status == 409
        assert "leads into the no-fly zone North" in refused.json["detail"]
        await alice.centre_sticks()
        await alice.set_mode(LOITER)
        alice.hold_sticks(pitch=-FULL)
        await alice.until(lambda: from_edge_m(home, alice.place_deg) > 45, "back at home")

    def is_recorded() -> bool:
        trail = admin.ask("GET", "/audit?limit=500").json
        return sum(one["action"] == "control.zone" for one in trail) >= 1

    await asyncio.to_thread(wait_for, "the hold in the audit trail", is_recorded)
    drone = await asyncio.to_thread(admin.drone, 1)
    assert drone["holder"]["name"] == "alice", "a zone is no reason to take control"
