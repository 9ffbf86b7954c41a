"""Flies a mission with a real ArduCopter on TCP and on a serial line (a pseudo-terminal); all else as installed."""

from __future__ import annotations

import asyncio
import importlib.util
from pathlib import Path

import pytest
from integration.test_ports_flown import AUTO, LON_E7, MISSION, commanded
from real.tcp_bridge import bridged
from worlds.pilot import at_the_controls
from worlds.processes import World
from worlds.serial_cable import SerialCable

from bench.real_autopilot import TCP_PORT, Receiver, flying


@pytest.mark.parametrize("port", ["tcp", "serial"])
async def test_a_port_carries_a_mission_that_is_flown(arducopter: Path, tmp_path: Path, port: str) -> None:
    assert importlib.util.find_spec("uvloop"), f"{port} is to be tried on the loop that is installed"
    async with flying(arducopter, tmp_path / "autopilot", receiver=Receiver.LOW, on_tcp=True) as autopilot:
        installed = World(tmp_path / "world", as_installed=True)
        with installed as world, bridged(autopilot.namespace, TCP_PORT) as tcp:
            world.add_user("alice")
            assert world.add_drone("Kestrel", "alice") == 1
            await asyncio.to_thread(world.start_tower)
            cable = SerialCable(tcp) if port == "serial" else None
            world.start_agent("Kestrel", f"serial:{cable.device}:115200" if cable else f"tcp:127.0.0.1:{tcp}")
            alice = world.visitor("alice")
            await asyncio.to_thread(world.wait_until_online, alice, 1)
            async with at_the_controls(alice, 1) as pilot:
                await pilot.until(lambda: pilot.has_position, "a position")
                put = await pilot.ask("PUT", "/mission", {"items": MISSION})
                assert (put.status, put.json["state"]) == (200, "done"), put.body
                fresh = (await pilot.ask("GET", "/mission?fresh=true")).json
                assert (fresh["state"], fresh["count"]) == ("known", len(MISSION))
                await pilot.accept_loss_check()
                for command in ({"command": "takeoff", "height_m": 10}, {"command": "start"}):
                    await commanded(pilot, command)
                    await pilot.until(lambda: pilot.altitude_m > 8, "the air")
                await pilot.until(lambda: pilot.mode == AUTO, "AUTO")
                await pilot.until(lambda: pilot.place_deg[1] > (LON_E7 + 1800) / 1e7, "the second way-point", 60.0)
                await pilot.until(lambda: not pilot.armed, "the landing at home", 120.0)
            assert "Traceback" not in world.log_of("agent-Kestrel")
            if cable is not None:
                cable.unplug()
