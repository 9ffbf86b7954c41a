"""A survey of two hundred items that the planner made (`web/test/plan/hills_survey.test.ts`), flown over the hills."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Final

from simulator.dialect import mavlink
from simulator.mission_plan import Item, PlanKind
from simulator.modes import Mode
from simulator.terrain import ground_around

SURVEY: Final = Path(__file__).parents[3] / "web" / "test" / "plan" / "files" / "hills_survey.json"
HEIGHT_M: Final = 50.0
WITHIN_M: Final = 3.0
LOOK_EVERY_S: Final = 0.5
STEP_S: Final = 0.1
FAST: Final = {"WPNAV_SPEED": 1000.0, "WPNAV_SPEED_UP": 400.0, "WPNAV_SPEED_DN": 300.0}
"""Twice the usual speed: half the time, and the harder flight."""
MAX_ITEMS: Final = 203 if os.environ.get("FLY_ALL_ITEMS") else 45
"""All of them take half an hour of flight, and half a minute here: on demand."""


def test_the_drone_keeps_its_height_above_the_ground(ground) -> None:
    rows = json.loads(SURVEY.read_text())
    assert len(rows) >= 200
    station = ground(battery_mah=200_000, parameters=FAST).ready()
    station.body.ground = ground_around(0.0, 0.0)
    items = [Item(command, frame, tuple(v or 0.0 for v in four), x, y, z) for command, frame, four, x, y, z, _ in rows]
    first = len(("home", "take-off", "first"))
    station.flight.plans.store(
        PlanKind.MISSION, [Item(16, 0), Item(22, 3, z=items[0].z), *items, Item(20)], station.flight.home
    )
    station.set_mode(Mode.GUIDED)
    station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    station.command(mavlink.MAV_CMD_MISSION_START)
    plans = station.flight.plans
    station.until(lambda: plans.current >= first, 300)
    gaps: list[float] = []
    while plans.current < MAX_ITEMS + 2:
        end_s = station.now_s + LOOK_EVERY_S
        while station.now_s < end_s:  # without reading what it says: that takes twice the time of flying
            station.now_s += STEP_S
            station.vehicle.step(station.now_s)
        station.vehicle.datagrams_to_send()
        gaps.append(station.body.alt_m - station.body.ground_m() - HEIGHT_M)
        assert abs(gaps[-1]) < WITHIN_M, f"{gaps[-1]:+.1f} m on the way to item {plans.current}"
    assert len(gaps) * LOOK_EVERY_S > 200
    print(f"{MAX_ITEMS} items, {len(gaps) * LOOK_EVERY_S:.0f} s: from {min(gaps):+.2f} to {max(gaps):+.2f} m")
