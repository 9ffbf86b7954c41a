"""Two vehicles on one line, through real programs: an agent serves one and tells of the other, or serves both as two
drones."""

import asyncio
import math
from pathlib import Path
from typing import Final

from worlds.free_ports import free_udp_ports
from worlds.pilot import ALT_HOLD, GUIDED, Pilot, at_the_controls
from worlds.processes import Visitor, World, wait_for
from worlds.shared_line import shared_line

from wire.dialect import mavlink

HOMES: Final = {1: (47.3977, 8.5456), 2: (47.4977, 8.5456)}
"""11 km apart: a single mixed position makes a leg that nobody flew."""
HEIGHTS_M: Final = {1: 8.0, 2: 14.0}


def start_vehicles(world: World, line: int) -> None:
    for system, (lat, lon) in HOMES.items():
        home = ("--home", f"{lat},{lon},488,0", "--boot-s", "1", "--sysid", str(system))
        battery = ("--battery-mah", str(5200 * system))
        world.start(f"vehicle-{system}", "tower-sim", "--count", "1", *home, *battery, "--out", f"udp:127.0.0.1:{line}")


def is_at_home(place_deg: tuple[float, float], system: int) -> bool:
    return math.dist(place_deg, HOMES[system]) < 0.01


async def land(pilot: Pilot) -> None:
    await pilot.set_mode(9)
    await pilot.until(lambda: not pilot.armed, "the landing", 90.0)


async def test_the_other_vehicle_is_told_and_neither_seen_nor_flown(tmp_path: Path) -> None:
    with World(tmp_path) as world:
        world.add_user("alice")
        world.add_drone("Kestrel", "alice")
        world.start_tower()
        (port,) = free_udp_ports(1)
        world.start_agent("Kestrel", f"udpin:127.0.0.1:{port}", "--system-id", "1")
        with shared_line(port) as line:
            start_vehicles(world, line)
            alice = world.visitor("alice")
            told = await asyncio.to_thread(wait_for, "the other vehicle", lambda: _alert(alice, "other-autopilot"))
            assert "system 2, is on the line of Kestrel" in told["words"]
            assert alice.drone(1)["other_systems"] == [2]
            async with at_the_controls(alice, 1) as pilot:
                pilot.system = 2
                for message in (
                    mavlink.MAVLink_command_long_message(2, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
                    mavlink.MAVLink_manual_control_message(2, 0, 0, 1000, 0, 0),
                    mavlink.MAVLink_set_mode_message(0, 1, GUIDED),
                ):
                    await pilot.send(message)
                notice = await pilot.until_event("notice", code="other-vehicle")
                assert "another vehicle than Kestrel" in notice["text"]
                # The tower refuses a command in the name of whoever it was for.
                pilot.system = 1
                pilot.systems.clear()
                await pilot.take_off(HEIGHTS_M[1])
                assert is_at_home(pilot.place_deg, 1)
                await land(pilot)
                assert pilot.systems == {1}
            flights = await asyncio.to_thread(
                wait_for, "the flight", lambda: _finished(alice.ask("GET", "/flights").json["flights"])
            )
            assert flights[0]["distance_m"] < 100.0
            table = alice.ask("GET", f"/flights/{flights[0]['id']}/export/csv").body.decode()
            assert "47.397" in table
            assert "47.497" not in table, "a place of vehicle 2"


async def test_one_agent_flies_and_holds_both_as_two_drones(tmp_path: Path) -> None:
    with World(tmp_path) as world:
        for name in ("alice", "bob"):
            world.add_user(name)
        world.add_user("root", "admin")
        world.add_drone("Kestrel", "alice")
        world.add_drone("Merlin", "bob")
        world.start_tower()
        (port,) = free_udp_ports(1)
        also = ("--system-id", "1", "--also", f"2={world.token_file('Merlin')}")
        world.start_agent("Kestrel", f"udpin:127.0.0.1:{port}", *also)
        with shared_line(port) as line:
            start_vehicles(world, line)
            alice, bob, root = (world.visitor(name) for name in ("alice", "bob", "root"))
            await asyncio.to_thread(
                wait_for,
                "both vehicles",
                lambda: alice.drone(1).get("autopilot_heard") and bob.drone(2).get("autopilot_heard"),
            )
            async with at_the_controls(alice, 1) as one, at_the_controls(bob, 2) as other:
                other.system = 2
                await asyncio.gather(one.take_off(HEIGHTS_M[1]), other.take_off(HEIGHTS_M[2]))
                for pilot, system in ((one, 1), (other, 2)):
                    assert is_at_home(pilot.place_deg, system)
                    pilot.hold_sticks()
                    await pilot.set_mode(5)
                # An admin takes one of them: that one holds, and the other one flies on by hand.
                assert root.ask("POST", "/drones/2/control/take", {}).status == 200
                await other.until(lambda: other.confirmed_holds > 0, "the hold of Merlin")
                assert one.confirmed_holds == 0
                assert one.mode == 5 and ALT_HOLD not in one.modes
                assert root.drone(2)["hold"] is not None
                assert alice.drone(1)["hold"] is None
                one.let_go()
                await land(one)
                assert root.ask("POST", "/drones/2/commands", {"command": "land"}).json["state"] == "done"
                await other.until(lambda: not other.armed, "the landing of Merlin", 90.0)
                assert (one.systems, other.systems) == ({1}, {2})
            assert not _alert(root, "other-autopilot"), "each is the other's neighbour, and nobody need be told"


def _alert(visitor: Visitor, rule: str) -> dict[str, str] | None:
    return next((one for one in visitor.ask("GET", "/alerts").json if one["rule"] == rule), None)


def _finished(flights: list[dict[str, object]]) -> list[dict[str, object]] | None:
    return [one for one in flights if one["ended_at"] and one["distance_m"] is not None] or None
