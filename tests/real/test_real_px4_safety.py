"""What a real PX4 does by itself, and what people are told: stick gesture, motors stopped, failsafe, arming checks.

`PX4=... pytest tests/real/test_real_px4_safety.py`. It flies in real time.
"""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest
from real.test_real_px4_flown import ALTCTL, LOITER, POSCTL, RETURN, Flown, flown

from wire.dialect import mavlink

STABILIZED = 7 << 16
HIGH_M = 40.0
GESTURE_S = 2.5
"""COM_RC_ARM_HYST is one second."""
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
FORCED = 21196.0
PARAMETERS = {"NAV_RCL_ACT": 2, "COM_RCL_EXCEPT": 7}


async def by_hand(flight: Flown, mode: int, name: str) -> None:
    pilot = flight.pilot
    await pilot.centre_sticks()
    for _ in range(5):
        await pilot.ask("POST", "/commands", {"command": "mode", "mode": name})
        if pilot.mode == mode:
            return
        await asyncio.sleep(0.5)
    await pilot.until(lambda: pilot.mode == mode, name, 10)


async def set_up(flight: Flown) -> None:
    for _ in range(100):
        if (await flight.pilot.ask("GET", "/parameters")).status == 200:
            break
        await asyncio.sleep(0.2)
    await flight.work("PATCH", "/parameters", {"values": PARAMETERS})


async def climb_to(flight: Flown, height_m: float) -> None:
    flight.pilot.hold_sticks(throttle=1000)
    await flight.pilot.until(lambda: flight.pilot.altitude_m > height_m, "height", 90)


def rules_opened(events: list[dict[str, Any]]) -> list[str]:
    return [one["alert"]["rule"] for one in events if one["type"] == "alert" and one["alert"]["closed_at"] is None]


@pytest.mark.parametrize("ladder", [[], ["AUTO.LOITER"]], ids=["default", "loiter first"])
async def test_takes_out_of_a_full_climb_stay(px4_build: Path, tmp_path: Path, ladder: list[str]) -> None:
    async with flown(px4_build, tmp_path) as flight:
        pilot = flight.pilot
        await set_up(flight)
        settings = {"lost_action": "stay", "hold_ladder": ladder}
        await asyncio.to_thread(flight.admin.ask, "PATCH", "/drones/1/settings", settings)
        await flight.up(20)
        for _ in range(3):
            await by_hand(flight, POSCTL, "POSCTL")
            pilot.hold_sticks(throttle=1000)
            await asyncio.sleep(2.0)
            assert await flight.ask_admin("take") == 200
            pilot.let_go()
            await pilot.until(lambda: pilot.mode == LOITER, "the mode that stays", 5)
            since = len(pilot.modes)
            await asyncio.sleep(10.0)
            assert pilot.modes[since:] == [], "it stays in the mode"
            assert flight.autopilot.station.newest["HEARTBEAT"].system_status == mavlink.MAV_STATE_ACTIVE
            assert await flight.ask_admin("give") == 200
            answer = await pilot.ask("POST", "/control/accept", {"sticks_centred": True})
            assert answer.status == 200, answer.body


async def test_the_stick_gesture_stops_no_motors_in_the_air(px4_build: Path, tmp_path: Path) -> None:
    async with flown(px4_build, tmp_path) as flight:
        pilot = flight.pilot
        await set_up(flight)
        await flight.up(15)
        await by_hand(flight, ALTCTL, "ALTCTL")
        await climb_to(flight, HIGH_M)
        await by_hand(flight, STABILIZED, "STABILIZED")
        pilot.hold_sticks(throttle=0, yaw=-1000)
        await asyncio.sleep(GESTURE_S)
        pilot.hold_sticks()
        assert pilot.armed
        await by_hand(flight, ALTCTL, "ALTCTL")
        assert pilot.armed and pilot.altitude_m > 5
        assert any("Sticks do not arm or disarm" in text for text in pilot.texts), pilot.texts[-4:]


async def test_motors_that_another_station_stops_in_the_air_are_told(px4_build: Path, tmp_path: Path) -> None:
    async with flown(px4_build, tmp_path) as flight:
        pilot, station = flight.pilot, flight.autopilot.station
        await set_up(flight)
        await flight.up(40)
        assert await station.ask(ARM, 0.0, FORCED) == 0
        began = asyncio.get_running_loop().time()
        await pilot.until(lambda: "motors-stopped" in rules_opened(pilot.events), "the alert", 5)
        took_s = asyncio.get_running_loop().time() - began
        print(f"told after {took_s:.2f} s")
        assert took_s < 1.5
        for _ in range(50):
            rows = await asyncio.to_thread(flight.admin.ask, "GET", "/audit?action=drone.motors_stopped")
            if rows.json:
                break
            await asyncio.sleep(0.1)
        assert "m above home" in rows.body.decode(), rows.body


async def test_a_commanded_return_raises_no_failsafe_and_a_lost_hand_does(px4_build: Path, tmp_path: Path) -> None:
    async with flown(px4_build, tmp_path) as flight:
        pilot, station = flight.pilot, flight.autopilot.station
        await set_up(flight)
        await flight.up(20)
        await by_hand(flight, POSCTL, "POSCTL")
        await flight.command("rtl")
        pilot.let_go()
        await pilot.until(lambda: pilot.mode == RETURN, "the return", 10)
        await asyncio.sleep(6.0)
        assert not {"failsafe", "emergency"} & set(rules_opened(pilot.events))
        assert await station.ask(mavlink.MAV_CMD_DO_SET_MODE, 1.0, 4.0, 3.0) == 0
        station.send(mavlink.MAVLink_param_set_message(1, 1, b"COM_RCL_EXCEPT", 0.0, 6))
        await pilot.until(lambda: "failsafe" in rules_opened(pilot.events), "the failsafe's alert", 15)
        alert = next(
            one["alert"] for one in pilot.events if one["type"] == "alert" and one["alert"]["rule"] == "failsafe"
        )
        assert "no sticks arrive" in alert["words"], alert


async def test_why_it_does_not_arm_is_on_the_checklist(px4_build: Path, tmp_path: Path) -> None:
    async with flown(px4_build, tmp_path) as flight:
        pilot = flight.pilot

        async def arming() -> dict[str, Any]:
            lines = (await pilot.ask("GET", "/preflight")).json["lines"]
            line: dict[str, Any] = next(one for one in lines if one["key"] == "arming")
            return line

        async def until(state: str, words: str) -> None:
            for _ in range(100):
                line = await arming()
                if line["state"] == state and words in line["words"]:
                    return
                await asyncio.sleep(0.1)
            raise AssertionError(line)

        await until("good", "ready to arm")
        await pilot.ask("POST", "/commands", {"command": "mode", "mode": "POSCTL"})
        await until("bad", "no sticks arrive")
