"""A landing on a pad through real programs: the camera of tower-sim, the agent's process that looks for the pad, and
LANDING_TARGET at the autopilot."""

import asyncio
from pathlib import Path

from worlds.pilot import at_the_controls
from worlds.processes import World, free_tcp_port, free_udp_ports, wait_for

from server.control.core.loan_limits import Home

PAD_LAT, PAD_LON = 47.3977, 8.5456
BESIDE_M = 2.0
HEIGHT_M = 6.0
WITHIN_M = 0.5
"""Not the 0.3 m of the benchmark: here pictures and detector share the machine with other tests."""


async def test_it_lands_on_the_pad_and_not_where_land_was_commanded(tmp_path: Path) -> None:
    with World(tmp_path) as world:
        world.add_user("alice")
        world.add_drone("Kestrel", "alice")
        world.start_tower()
        (port,), camera = free_udp_ports(1), free_tcp_port()
        pad = ("--landing-pad", "aruco-4x4-50:0=1.0@0,0.85;1=0.16")
        looks = f"http://127.0.0.1:{camera}/camera?tilt=90&width=640&height=480&rate=10#tilt=90&fov=75"
        world.start_agent("Kestrel", f"udpin:127.0.0.1:{port}", *pad, "--landing-camera", looks)
        home = ("--home", f"{PAD_LAT - BESIDE_M / 111_320},{PAD_LON},488,0", "--boot-s", "1", "--wind", "4,60")
        options = ("--landing-pad", f"{PAD_LAT},{PAD_LON},30", "--param", "PLND_TYPE=1", "--param", "PLND_LAG=0.1")
        out = ("--out", f"udp:127.0.0.1:{port}", "--camera", str(camera))
        world.start("simulator", "tower-sim", "--count", "1", *home, *out, *options)
        alice = world.visitor("alice")
        await asyncio.to_thread(wait_for, "the autopilot to be heard", lambda: alice.drone(1).get("autopilot_heard"))
        async with at_the_controls(alice, 1) as pilot:
            await pilot.take_off(HEIGHT_M)
            where = Home(PAD_LAT, PAD_LON, 0)
            assert where.distance_m(*pilot.place_deg) > BESIDE_M - 0.8
            # The process and the camera's land take their time to load.
            await pilot.until(lambda: "PrecLand: Init Complete" in pilot.texts, "the pad to be found", 90.0)
            answer = await pilot.ask("POST", "/commands", {"command": "land"})
            assert answer.json["state"] == "done", answer.body
            await pilot.until(lambda: not pilot.armed, "the landing", 180.0)
            await pilot.until(lambda: where.distance_m(*pilot.place_deg) < WITHIN_M, f"the pad {pilot.place_deg}", 5.0)
        assert "looking for the landing pad" in world.log_of("agent-Kestrel")
