"""A real PX4 behind a real tower and agent: commands, a mission, a TAKE during a flight by hand, parameters.

`PX4=... pytest tests/real/test_real_px4_flown.py`. It flies in real time.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

import pytest
from worlds.free_ports import free_udp_ports
from worlds.pilot import Pilot, at_the_controls, watching
from worlds.processes import Visitor, World, wait_for

from bench.real_px4 import Cable, RealPx4, flying_px4
from wire.dialect import mavlink

ALTCTL, POSCTL, ORBIT = 2 << 16, 3 << 16, 3 << 16 | 1 << 24
LOITER, MISSION, RETURN = (4 << 16 | sub << 24 for sub in (3, 4, 5))
LAT, LON = 47.3977, 8.5456
LAT_E7, LON_E7 = 473977000, 85456000
NOT_KNOWN = 0x7FFFFFFF
BATTERY = {"SIM_BAT_DRAIN": 100_000.0}
"""Otherwise its battery is half empty after a minute, and needed for the way home."""


class Flown:
    """A tower, an agent and a PX4, with its operator at the controls. `admin` watches."""

    def __init__(self, autopilot: RealPx4, world: World, pilot: Pilot, admin: Visitor) -> None:
        self.autopilot, self.world, self.pilot, self.admin = autopilot, world, pilot, admin

    async def command(self, command_: str, **body: Any) -> Any:
        """Runs a command until it is done."""
        answer = await self.pilot.ask("POST", "/commands", {"command": command_} | body)
        assert (answer.status, answer.json.get("state")) == (200, "done"), answer.body
        return answer.json

    async def work(self, method: str, path: str, body: Any = None) -> Any:
        answer = await self.pilot.ask(method, path, body)
        assert (answer.status, answer.json.get("state")) in ((200, "done"), (200, "known")), answer.body
        return answer.json

    async def up(self, height_m: float) -> None:
        """Takes off once home and the effect of a lost link are known."""
        for _ in range(100):
            await self.pilot.ask("POST", "/loss-check/acknowledge", {"drone": "Kestrel"})
            begun = await self.pilot.ask("POST", "/commands", {"command": "takeoff", "height_m": height_m})
            if begun.status == 200:
                break
            await asyncio.sleep(0.2)
        assert begun.json.get("state") == "done", begun.body
        pilot = self.pilot
        await pilot.until(lambda: abs(pilot.altitude_m - height_m) < 1 and pilot.mode == LOITER, "the height", 60)

    async def ask_admin(self, path: str) -> int:
        answer = await asyncio.to_thread(self.admin.ask, "POST", f"/drones/1/control/{path}")
        return answer.status

    @property
    def heading_deg(self) -> float:
        return math.degrees(self.autopilot.station.newest["ATTITUDE"].yaw) % 360.0

    @property
    def speed_m_s(self) -> float:
        moved = self.autopilot.station.newest["GLOBAL_POSITION_INT"]
        return math.hypot(moved.vx, moved.vy) / 100


@contextlib.asynccontextmanager
async def flown(build: Path, folder: Path) -> AsyncIterator[Flown]:
    async with flying_px4(build, folder / "autopilot", parameters=BATTERY) as autopilot:
        with World(folder / "world") as world:
            world.add_user("alice")
            world.add_user("ada", "admin")
            assert world.add_drone("Kestrel", "alice") == 1
            await asyncio.to_thread(world.start_tower)
            port = free_udp_ports(1)[0]
            world.start_agent("Kestrel", f"udpin:127.0.0.1:{port}")
            cable = Cable(autopilot, port)
            try:
                alice, ada = world.visitor("alice"), world.visitor("ada")
                await asyncio.to_thread(wait_for, "PX4 to be heard", lambda: alice.drone(1).get("autopilot_heard"))
                async with at_the_controls(alice, 1) as pilot, watching(ada, 1):
                    await pilot.until(lambda: pilot.has_position, "a position")
                    yield Flown(autopilot, world, pilot, ada)
                assert "Traceback" not in world.log_of("agent-Kestrel")
            finally:
                cable.cut()


def is_at(pilot: Pilot, lat: float, lon: float) -> Callable[[], bool]:
    return lambda: abs(pilot.place_deg[0] - lat) < 2e-5 and abs(pilot.place_deg[1] - lon) < 3e-5


async def test_it_does_what_it_is_told(px4_build: Path, tmp_path: Path) -> None:
    async with flown(px4_build, tmp_path) as flight:
        pilot = flight.pilot
        await flight.up(15)
        await flight.command("goto", lat=LAT + 0.0003, lon=LON, height_m=25, speed_m_s=8)
        await pilot.until(is_at(pilot, LAT + 0.0003, LON), "the place")
        await pilot.until(lambda: abs(pilot.altitude_m - 25) < 1, "25 m")
        await flight.command("orbit", lat=LAT + 0.0003, lon=LON, radius_m=20, height_m=25, m_s=4)
        await pilot.until(lambda: pilot.mode == ORBIT, "the orbit's mode")

        def radius_m() -> float:
            north = (pilot.place_deg[0] - LAT - 0.0003) * 111_320
            return math.hypot(north, (pilot.place_deg[1] - LON) * 111_320 * math.cos(math.radians(LAT)))

        await pilot.until(lambda: 18 < radius_m() < 22, "the orbit")
        await flight.command("hold")
        await pilot.until(lambda: pilot.mode == LOITER, "the hold")
        await flight.command("land")
        await pilot.until(lambda: not pilot.armed, "the landing", 90)


@pytest.mark.parametrize("here", [True, False], ids=["place named", "no place named"])
async def test_it_turns_by_a_reposition_in_radians(px4_build: Path, tmp_path: Path, here: bool) -> None:
    async with flown(px4_build, tmp_path) as flight:
        pilot = flight.pilot
        await flight.up(10)
        at = flight.autopilot.station.newest["GLOBAL_POSITION_INT"]
        place = (at.lat, at.lon, at.alt / 1000) if here else (NOT_KNOWN, NOT_KNOWN, math.nan)
        reposition = mavlink.MAV_CMD_DO_REPOSITION
        before = pilot.place_deg
        await pilot.send(
            mavlink.MAVLink_command_int_message(1, 1, 0, reposition, 0, 0, -1, 1, 0, math.radians(90), *place)
        )
        await pilot.until(lambda: abs(flight.heading_deg - 90) < 2, "90 degrees")
        await pilot.until(is_at(pilot, *before), "the same place")
        assert abs(pilot.altitude_m - 10) < 1.5


async def test_a_mission_goes_up_and_is_flown(px4_build: Path, tmp_path: Path) -> None:
    line = [[16, 3, [0, 0, 0, None], LAT_E7 + 1800 * number, LON_E7, 20, 1] for number in range(1, 5)]
    items = [
        [22, 3, [0, 0, 0, None], LAT_E7, LON_E7, 20, 1],
        [178, 2, [1, 8, -1, 0], 0, 0, 0, 1],
        *line,
        [177, 2, [3, 1, 0, 0], 0, 0, 0, 1],
        [20, 2, [0, 0, 0, 0], 0, 0, 0, 1],
    ]
    corners = ((-20000, -20000), (20000, -20000), (20000, 20000), (-20000, 20000))
    async with flown(px4_build, tmp_path) as flight:
        pilot = flight.pilot
        await flight.work("PUT", "/mission", {"items": items})
        await flight.work(
            "PUT", "/fence", {"items": [[5001, 3, [4, 0, 0, 0], LAT_E7 + x, LON_E7 + y, 0, 1] for x, y in corners]}
        )
        assert (await flight.work("GET", "/mission?fresh=true"))["count"] == len(items)
        await flight.up(10)
        await flight.command("start", item=0)
        await pilot.until(lambda: pilot.mode == MISSION, "the mission")
        await pilot.until(lambda: pilot.place_deg[0] > LAT + 0.0003, "the second place", 60)
        await flight.command("pause")
        await pilot.until(lambda: pilot.mode == LOITER, "the pause")
        await flight.command("resume")
        await pilot.until(lambda: pilot.mode == MISSION, "the mission again")
        await flight.command("jump", item=5)
        station = flight.autopilot.station
        await pilot.until(lambda: station.newest["MISSION_CURRENT"].seq >= 5, "item 6")
        await pilot.until(lambda: pilot.mode == RETURN, "the way home", 120)
        await pilot.until(lambda: not pilot.armed, "the landing", 120)


async def test_a_take_ends_a_flight_by_hand_in_a_mode_that_stays(px4_build: Path, tmp_path: Path) -> None:
    async with flown(px4_build, tmp_path) as flight:
        pilot = flight.pilot
        await flight.up(15)
        await pilot.centre_sticks()
        await flight.command("mode", mode="POSCTL")
        pilot.hold_sticks(pitch=600)
        await pilot.until(lambda: flight.speed_m_s > 1.5, "speed")
        assert await flight.ask_admin("take") == 200
        confirmed = await pilot.until_event("hold", step="confirmed")
        assert (confirmed["detail"], confirmed["elapsed_ms"] < 250) == ("ALTCTL", True)
        await pilot.until(lambda: pilot.mode == LOITER, "the mode that stays", 5)
        pilot.let_go()
        await pilot.until(lambda: flight.speed_m_s < 0.5, "rest", 15)
        assert (pilot.mode, abs(pilot.altitude_m - 15) < 1.5) == (LOITER, True)

        assert await flight.ask_admin("give") == 200
        answer = await pilot.ask("POST", "/control/accept", {"sticks_centred": True})
        assert answer.status == 200, answer.body
        await pilot.centre_sticks()
        await flight.command("mode", mode="POSCTL")
        assert (await pilot.ask("POST", "/control/release")).status == 200
        pilot.let_go()
        await pilot.until(lambda: pilot.mode == LOITER, "a hold without anybody", 5)


@pytest.mark.parametrize("whose", ["command", "take"])
async def test_a_hold_ends_a_go_to(px4_build: Path, tmp_path: Path, whose: str) -> None:
    async with flown(px4_build, tmp_path) as flight:
        pilot = flight.pilot
        await flight.autopilot.station.set_whole("COM_RC_IN_MODE", 0)
        await flight.up(15)
        await flight.command("goto", lat=LAT + 0.01, lon=LON, height_m=15)
        await pilot.until(lambda: flight.speed_m_s > 3.0, "the way", 20)
        if whose == "command":
            await flight.command("hold")
        else:
            assert await flight.ask_admin("take") == 200
        await pilot.until(lambda: flight.speed_m_s < 0.5, "rest", 10)
        await asyncio.sleep(8.0)  # it comes back to where it was to stop
        at = pilot.place_deg
        await asyncio.sleep(5.0)
        assert is_at(pilot, *at)()
        assert (pilot.mode, abs(pilot.altitude_m - 15) < 1.5) == (LOITER, True)


async def test_its_parameters_are_known_with_what_it_says_of_them(px4_build: Path, tmp_path: Path) -> None:
    async with flown(px4_build, tmp_path) as flight:
        pilot = flight.pilot

        async def reported(path: str) -> Any:
            for _ in range(300):
                answer = await pilot.ask("GET", path)
                if answer.status == 200:
                    return answer.json
                await asyncio.sleep(0.1)
            raise AssertionError(answer.body)

        values = {one["name"]: one["value"] for one in (await reported("/parameters"))["values"]}
        assert len(values) > 850
        wanted = {"MAV_SYS_ID": 1, "COM_RC_IN_MODE": 1, "SIM_BAT_DRAIN": 100_000}
        assert {name: values[name] for name in wanted} == wanted
        written = await flight.work("PATCH", "/parameters", {"values": {"RTL_RETURN_ALT": 25.5, "COM_RC_IN_MODE": 3}})
        assert not written["refusals"]
        described = {one["name"] for one in (await reported("/parameters/metadata"))["parameters"]}
        assert {name for name in values if name not in described and not name.startswith(("CAL_", "TC_"))} == set()
