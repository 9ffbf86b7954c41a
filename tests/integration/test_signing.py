"""MAVLink signing between agent and autopilot through real programs: set up from outside, flown with, kept over a death
of the agent, changed, lost, and taken away."""

import asyncio
from pathlib import Path
from typing import Any, Final

from worlds.pilot import at_the_controls
from worlds.processes import Visitor, World, kill_9, wait_for

SIGNING: Final = "/drones/1/signing"


def keys_of(world: World) -> list[bytes]:
    lines = (world.folder / "agents" / "drone-1" / "signing-key").read_text().split()
    return [bytes.fromhex(one) for one in lines if one != "unsigned"]


def change(alice: Visitor, method: str = "POST") -> dict[str, Any]:
    done: dict[str, Any] = alice.ask(method, SIGNING).json
    return done


async def drone_shows(alice: Visitor, signing: str) -> None:
    await asyncio.to_thread(wait_for, signing, lambda: alice.drone(1)["signing"] == signing or None)


async def answers(alice: Visitor) -> None:
    """The autopilot takes what the agent sends."""
    await asyncio.to_thread(wait_for, "an answer", lambda: alice.drone(1)["hears_agent"])


async def test_a_drone_is_flown_held_and_landed_over_a_signed_line(tmp_path: Path) -> None:
    with World(tmp_path) as world:
        world.add_user("alice")
        world.add_user("root", "admin")
        world.add_drone("Kestrel", "alice")
        world.start_tower()
        world.start_simulated("Kestrel", options=("--boot-s", "1"))
        alice, root = world.visitor("alice"), world.visitor("root")
        assert change(alice)["type"] == "/problems/not-in-control"
        async with at_the_controls(alice, 1) as pilot:
            await pilot.until(lambda: pilot.has_position, "a position")
            done = change(alice)
            assert done["state"] == "done", done["words"]
            (first,) = keys_of(world)
            await drone_shows(alice, "on")
            await pilot.take_off(10.0)
            assert change(alice)["state"] == "refused", "not in the air"
            assert root.ask("POST", "/drones/1/control/take", {}).status == 200
            await pilot.until(lambda: pilot.confirmed_holds > 0, "the hold")
            assert root.ask("POST", "/drones/1/commands", {"command": "land"}).json["state"] == "done"
            await pilot.until(lambda: not pilot.armed, "the landing", 90.0)
            assert root.ask("POST", "/drones/1/control/release", {}).status == 200

            agent = world.running("agent-Kestrel")
            kill_9(agent)
            agent.wait()
            world.restart("agent-Kestrel")

        async with at_the_controls(alice, 1):
            # What the tower shows may still be what the dead agent said.
            await asyncio.to_thread(wait_for, "another key", lambda: change(alice).get("state") == "done")
            (second,) = keys_of(world)
            assert second != first
            done = change(alice, "DELETE")
            assert done["state"] == "done", done["words"]
            await drone_shows(alice, "off")
            await answers(alice)
        for path in world.folder.rglob("*"):
            if path.is_file():
                content = path.read_bytes()
                assert not any(key in content or key.hex().encode() in content for key in (first, second)), path


async def test_an_agent_and_an_autopilot_with_other_keys_are_told_and_brought_together(tmp_path: Path) -> None:
    with World(tmp_path) as world:
        world.add_user("alice")
        world.add_drone("Kestrel", "alice")
        world.start_tower()
        world.start_simulated("Kestrel", options=("--boot-s", "1"))
        alice = world.visitor("alice")
        async with at_the_controls(alice, 1) as pilot:
            await pilot.until(lambda: pilot.has_position, "a position")
            assert change(alice)["state"] == "done"
            (key,) = keys_of(world)
            agent = world.running("agent-Kestrel")
            kill_9(agent)
            agent.wait()
            file = world.folder / "agents" / "drone-1" / "signing-key"
            file.unlink()
            world.restart("agent-Kestrel")
            await drone_shows(alice, "no_key")
            deaf = await asyncio.to_thread(wait_for, "the alert", lambda: _alert(alice, "deaf-autopilot"))
            assert "it signs, and its agent has no key" in deaf["words"]

            agent = world.running("agent-Kestrel")
            kill_9(agent)
            agent.wait()
            file.write_text(bytes(32).hex() + "\n")
            world.restart("agent-Kestrel")
            await drone_shows(alice, "wrong_key")
            told = await asyncio.to_thread(wait_for, "the alert", lambda: _alert(alice, "wrong-signing-key"))
            assert told["words"].startswith("The autopilot of Kestrel does not sign with the key of its agent")

            agent = world.running("agent-Kestrel")
            kill_9(agent)
            agent.wait()
            file.write_text(key.hex() + "\n")
            world.restart("agent-Kestrel")
            await answers(alice)
            await drone_shows(alice, "on")
            await asyncio.to_thread(wait_for, "no alert", lambda: not _alert(alice, "wrong-signing-key") or None)


def _alert(visitor: Visitor, rule: str) -> dict[str, str] | None:
    return next(
        (one for one in visitor.ask("GET", "/alerts").json if one["rule"] == rule and not one["closed_at"]), None
    )
