"""The stick gesture that disarms: a real ArduCopter in STABILIZE obeys it in the air, and does not get it."""

from __future__ import annotations

import asyncio
from pathlib import Path

from real.tcp_bridge import bridged
from worlds.pilot import ALT_HOLD, Pilot, at_the_controls
from worlds.processes import World

from bench.real_autopilot import TCP_PORT, Receiver, flying

STABILIZE = 0
HIGH_M = 90.0
"""With the throttle down it falls for some seconds."""
GESTURE_S = 3.0
"""ArduCopter disarms after two."""


async def test_throttle_down_and_yaw_left_does_not_stop_the_motors_in_the_air(arducopter: Path, tmp_path: Path) -> None:
    async with flying(arducopter, tmp_path / "autopilot", receiver=Receiver.LOW, on_tcp=True) as autopilot:
        with World(tmp_path / "world") as world, bridged(autopilot.namespace, TCP_PORT) as tcp:
            world.add_user("alice")
            assert world.add_drone("Kestrel", "alice") == 1
            await asyncio.to_thread(world.start_tower)
            world.start_agent("Kestrel", f"tcp:127.0.0.1:{tcp}")
            alice = world.visitor("alice")
            await asyncio.to_thread(world.wait_until_online, alice, 1)
            async with at_the_controls(alice, 1) as pilot:
                await pilot.take_off(10.0)
                pilot.hold_sticks(throttle=1000)
                await pilot.set_mode(ALT_HOLD)
                await pilot.until(lambda: pilot.altitude_m > HIGH_M, "height", 90.0)
                pilot.hold_sticks()
                await pilot.set_mode(STABILIZE)
                pilot.hold_sticks(throttle=0, yaw=-1000)
                was_armed = await armed_for(pilot, GESTURE_S)
                pilot.hold_sticks()
                await pilot.set_mode(ALT_HOLD)
                assert was_armed and pilot.armed
                assert any("Sticks do not arm or disarm" in text for text in pilot.texts), pilot.texts[-4:]
                await pilot.set_mode(9)
                pilot.let_go()


async def armed_for(pilot: Pilot, seconds: float) -> bool:
    """Whether it was armed all that time."""
    try:
        await pilot.until(lambda: not pilot.armed, "disarmed", seconds)
    except TimeoutError:
        return True
    return False
