"""MAVLink signing with a real ArduCopter, whose second port takes only signed frames once it has a key."""

from __future__ import annotations

import asyncio
from pathlib import Path

from real.tcp_bridge import bridged
from worlds.pilot import at_the_controls
from worlds.processes import World, kill_9, wait_for

from bench.real_autopilot import TCP_PORT, Receiver, flying

SIGNING = "/signing"


async def test_a_key_is_set_up_flown_with_changed_and_removed(arducopter: Path, tmp_path: Path) -> None:
    async with flying(
        arducopter, tmp_path / "autopilot", receiver=Receiver.LOW, on_tcp=True, agent_on_second=True
    ) as autopilot:
        with World(tmp_path / "world") as world, bridged(autopilot.namespace, TCP_PORT) as tcp:
            world.add_user("alice")
            world.add_user("root", "admin")
            assert world.add_drone("Kestrel", "alice") == 1
            await asyncio.to_thread(world.start_tower)
            world.start_agent("Kestrel", f"tcp:127.0.0.1:{tcp}")
            alice, root = world.visitor("alice"), world.visitor("root")
            await asyncio.to_thread(world.wait_until_online, alice, 1)
            async with at_the_controls(alice, 1) as pilot:
                await pilot.until(lambda: pilot.has_position, "a position")
                done = (await pilot.ask("POST", SIGNING)).json
                assert done["state"] == "done", done["words"]
                await pilot.accept_loss_check()
                await pilot.take_off(10.0)
                refused = (await pilot.ask("POST", SIGNING)).json
                assert refused["state"] == "refused"
                taken = await asyncio.to_thread(root.ask, "POST", "/drones/1/control/take", {})
                assert taken.status == 200
                await pilot.until(lambda: pilot.confirmed_holds > 0, "the hold")
                land = {"command": "land"}
                assert (await asyncio.to_thread(root.ask, "POST", "/drones/1/commands", land)).json["state"] == "done"
                await pilot.until(lambda: not pilot.armed, "the landing", 90.0)
                assert root.ask("POST", "/drones/1/control/release", {}).status == 200
            async with at_the_controls(alice, 1) as pilot:
                for method, shown in (("POST", "on"), ("POST", "on"), ("DELETE", "off"), ("POST", "on")):
                    done = (await pilot.ask(method, SIGNING)).json
                    assert done["state"] == "done", done["words"]
                    await asyncio.to_thread(wait_for, shown, lambda: alice.drone(1)["signing"] == shown)  # noqa: B023
                # A reboot keeps the key, and the time of its signatures.
                assert (await pilot.ask("POST", "/commands", {"command": "reboot"})).json["state"] == "done"
                await asyncio.to_thread(wait_for, "silence", lambda: not alice.drone(1)["hears_agent"])
                await asyncio.to_thread(wait_for, "an answer", lambda: alice.drone(1)["hears_agent"])
                assert alice.drone(1)["signing"] == "on"
            # Without its key the agent is not heard.
            agent = world.running("agent-Kestrel")
            kill_9(agent)
            agent.wait()
            (world.folder / "agents" / "drone-1" / "signing-key").unlink()
            world.restart("agent-Kestrel")
            await asyncio.to_thread(wait_for, "no key", lambda: alice.drone(1)["signing"] == "no_key")
            await asyncio.to_thread(wait_for, "it is deaf", lambda: alice.drone(1)["hears_agent"] is False)
