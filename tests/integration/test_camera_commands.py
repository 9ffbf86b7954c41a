"""The holder points the gimbal, zooms, takes photographs and records, by REST; a camera answers for itself."""

import asyncio
from pathlib import Path
from typing import Any

from worlds.pilot import at_the_controls
from worlds.processes import World, wait_for

from wire.dialect import mavlink


async def test_the_camera_and_the_gimbal_do_what_the_holder_says(tmp_path: Path) -> None:
    with World(tmp_path) as world:
        world.add_user("alice")
        world.add_user("bob")
        world.add_drone("Kestrel", "alice")
        world.start_tower()
        world.start_simulated("Kestrel", options=("--boot-s", "1", "--camera-component", "--gimbal"))
        alice, bob = world.visitor("alice"), world.visitor("bob")
        await asyncio.to_thread(wait_for, "the autopilot to be heard", lambda: alice.drone(1).get("autopilot_heard"))
        async with at_the_controls(alice, 1) as pilot:

            async def give(**body: Any) -> Any:
                return await pilot.ask("POST", "/commands", body)

            for body in (
                {"command": "gimbal", "pitch_deg": -60, "yaw_deg": 30},
                {"command": "zoom", "percent": 50},
                {"command": "zoom", "direction": "stop"},
                {"command": "photo"},
                {"command": "record", "on": True},
                {"command": "record", "on": False},
            ):
                done = await give(**body)
                assert (done.status, done.json["state"]) == (200, "done"), (body, done.body)
            gimbal = mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS
            await pilot.until(lambda: gimbal in pilot.heard, "the direction, which the gimbal tells by itself")
            none = await give(command="photo", camera=3)
            assert none.json["state"] == "timed_out", none.body
            assert "Kestrel" in none.json["words"] and "The camera has not answered" in none.json["words"]
            for wrong in (
                {"command": "zoom"},
                {"command": "zoom", "percent": 101},
                {"command": "photo", "count": 5},
                {"command": "gimbal", "pitch_deg": 200},
                {"command": "photo", "camera": 7},
                {"command": "servo", "servo": 300, "pulse_us": 1500},
                {"command": "servo", "servo": 9, "pulse_us": 3000},
            ):
                refused = await give(**wrong)
                assert refused.status == 422, (wrong, refused.body)
            denied = await asyncio.to_thread(bob.ask, "POST", "/drones/1/commands", {"command": "photo"})
            assert denied.status in (403, 404)
