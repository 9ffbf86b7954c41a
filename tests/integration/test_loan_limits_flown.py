"""A borrower flies by hand beyond the loan's limits: the real drone holds, reports why, and can be flown back."""

import asyncio
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from worlds.pilot import LOITER, Pilot, at_the_controls, fly_by_hand, watching
from worlds.processes import Visitor, World, wait_for

from server.control.core.loan_limits import Home

HEIGHT_M = 20.0
RADIUS_M = 30.0
FULL = 1000
UP, MIDDLE = 1000, 500
"""Throttle in the units of MANUAL_CONTROL."""


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    """Kestrel belongs to alice; bob has borrowed it."""
    with World(tmp_path) as world:
        for name, role in (("alice", "operator"), ("bob", "operator"), ("admin", "admin")):
            world.add_user(name, role)
        assert world.add_drone("Kestrel", "alice") == 1
        world.start_tower()
        world.start_simulated("Kestrel", options=("--boot-s", "1", "--seed", "3", "--speed", "2", "--real-rates"))
        world.wait_until_online(world.visitor("admin"), 1)
        yield world


def lend(admin: Visitor, name: str) -> None:
    [borrower] = [one for one in admin.ask("GET", "/users").json if one["name"] == name]
    until = (datetime.now(UTC) + timedelta(hours=1)).isoformat()
    terms = {"until": until, "max_height_m": HEIGHT_M, "radius_m": RADIUS_M}
    answer = admin.ask("PUT", f"/drones/1/loans/{borrower['id']}", terms)
    assert answer.status == 200, answer.body


async def read(pilot: Pilot, words: str) -> dict[str, Any]:
    """Waits for the loan notice with this text."""

    def found() -> list[dict[str, Any]]:
        return [one for one in pilot.events if one.get("code") == "loan" and words in one["text"]]

    await pilot.until(lambda: bool(found()), f"the notice {words!r}")
    return found()[0]


async def take_up_again(pilot: Pilot) -> None:
    """Resumes as after any hold: centred sticks first, then the mode."""
    await pilot.centre_sticks()
    await pilot.set_mode(LOITER)


async def test_flown_beyond_height_and_radius_it_holds_and_flies_back(world: World) -> None:
    admin = world.visitor("admin")
    lend(admin, "bob")
    async with watching(world.visitor("alice"), 1) as owner, at_the_controls(world.visitor("bob"), 1) as bob:
        await fly_by_hand(bob, 10.0)
        home = Home(*bob.place_deg, alt_amsl_m=0)

        held = bob.confirmed_holds
        bob.hold_sticks(throttle=UP)
        reported = await read(bob, f"above the {HEIGHT_M:.0f} m of the loan")
        assert "Kestrel holds" in reported["text"]
        assert (await read(owner, "above the"))["text"] == reported["text"]
        await bob.until(lambda: bob.confirmed_holds > held, "the hold")
        assert bob.altitude_m > HEIGHT_M
        await bob.until(lambda: abs(bob.climb_mps) < 0.2, "no more climbing, with the stick still up")
        assert bob.altitude_m < HEIGHT_M + 6.0

        # Flying back is allowed.
        await take_up_again(bob)
        bob.hold_sticks(throttle=0)
        await bob.until(lambda: bob.altitude_m < HEIGHT_M - 5.0, "back below")
        held = bob.confirmed_holds
        bob.hold_sticks(pitch=FULL)
        await read(bob, f"further from home than the {RADIUS_M:.0f} m of the loan")
        await bob.until(lambda: bob.confirmed_holds > held, "the hold")
        assert home.distance_m(*bob.place_deg) > RADIUS_M

    def both_are_recorded() -> bool:
        # Whoever is slow to let go of the sticks is held, and recorded, again.
        trail = admin.ask("GET", "/audit?limit=500").json
        why = [one["detail"]["why"] for one in trail if one["action"] == "control.loan_limit"]
        return all(any(words in one for one in why) for words in ("above the", "further from home"))

    await asyncio.to_thread(wait_for, "both limits in the audit trail", both_are_recorded)
    drone = await asyncio.to_thread(admin.drone, 1)
    assert drone["holder"]["name"] == "bob", "a limit is no reason to take control"
