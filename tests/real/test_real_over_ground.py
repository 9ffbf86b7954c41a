"""A real ArduCopter flies the planner's survey over the simulated hills, and keeps its height above the ground.

`ARDUCOPTER=... pytest tests/real/test_real_over_ground.py`. Its own simulator knows no hills: its true motion is
measured against those of `simulator/terrain.py`, for which the survey was made (`web/test/plan/hills_survey.test.ts`).
"""

from __future__ import annotations

import asyncio
from math import cos, radians
from pathlib import Path

import msgspec
from real.plan_exchange import PlanExchange

from bench.real_autopilot import Receiver, flying
from bench.rig import HOME, wait_for
from simulator.terrain import hills_m
from wire.autopilots.ardupilot_plans import ArduPilot
from wire.dialect import mavlink
from wire.plans import PlanItem, PlanKind
from wire.transactions import Outcome, PlanUploadWork

SURVEY = Path(__file__).parents[2] / "web" / "test" / "plan" / "files" / "hills_survey.json"
SURVEY_HOME = (47.397742, 8.545594, 488.0)
METRES_PER_DEGREE = 111_318.845
SPEEDUP = 10.0
HEIGHT_M, WITHIN_M = 50.0, 3.0
GUIDED, AUTO = 4, 3
SURE_TO_FLY_S = 500.0


async def test_a_real_autopilot_keeps_its_height_above_the_ground(arducopter: Path, tmp_path: Path) -> None:
    rows = msgspec.json.decode(SURVEY.read_bytes(), type=list[PlanItem])
    plan = (PlanItem(22, 3, z=rows[0].z), *rows, PlanItem(17, 3, x=rows[-1].x, y=rows[-1].y, z=rows[-1].z))
    parameters = {"WPNAV_SPEED": 500.0, "WP_SPD": 5.0, "SIM_BATT_CAP_AH": 0.0, "BATT_MONITOR": 0.0, "RTL_ALT": 10_000.0}
    async with flying(
        arducopter, tmp_path, receiver=Receiver.LOW, home=SURVEY_HOME, parameters=parameters
    ) as autopilot:
        truth = autopilot.truth
        result = await PlanExchange(autopilot, ArduPilot()).do(PlanUploadWork(PlanKind.MISSION, plan))
        assert result.outcome is Outcome.DONE, result.words
        assert await truth.ask(mavlink.MAV_CMD_DO_SET_MODE, 1, GUIDED) == mavlink.MAV_RESULT_ACCEPTED

        async def armed() -> bool:
            return bool(await truth.ask(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_ACCEPTED)

        await wait_for("it to arm", armed, 60)
        await truth.ask(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 20.0)
        await wait_for("it to climb", lambda: bool(truth.motions) and truth.motions[-1].alt_m > 15.0, 30)
        assert await truth.ask(mavlink.MAV_CMD_DO_SET_MODE, 1, AUTO) == mavlink.MAV_RESULT_ACCEPTED
        await truth.set_parameter("SIM_SPEEDUP", SPEEDUP)
        first, last = _place(rows[0]), _place(rows[-1])
        await wait_for("the first waypoint", lambda: _distance_m(_now(truth), first) < 3.0, 120)
        begun = len(truth.motions)
        loop = asyncio.get_running_loop()
        until = loop.time() + SURE_TO_FLY_S
        while _distance_m(_now(truth), last) > 3.0:
            assert loop.time() < until, "it did not come to the end of its survey"
            await asyncio.sleep(0.2)
        north_m, east_m = _offset_m()
        gaps = [
            one.alt_m - float(hills_m(one.north_m - north_m, one.east_m - east_m)) - HEIGHT_M
            for one in truth.motions[begun:]
        ]
        print(f"{len(rows)} items, {len(gaps)} positions: from {min(gaps):+.2f} to {max(gaps):+.2f} m")
        assert len(gaps) > 1_000
        assert max(map(abs, gaps)) < WITHIN_M


def _offset_m() -> tuple[float, float]:
    """North and east of the survey's home, from the place that the measured motion counts from."""
    scale = cos(radians(HOME[0]))
    return (SURVEY_HOME[0] - HOME[0]) * METRES_PER_DEGREE, (SURVEY_HOME[1] - HOME[1]) * METRES_PER_DEGREE * scale


def _place(item: PlanItem) -> tuple[float, float]:
    scale = cos(radians(HOME[0]))
    return (item.x / 1e7 - HOME[0]) * METRES_PER_DEGREE, (item.y / 1e7 - HOME[1]) * METRES_PER_DEGREE * scale


def _now(truth: object) -> tuple[float, float]:
    motions = truth.motions  # type: ignore[attr-defined]
    return motions[-1].north_m, motions[-1].east_m


def _distance_m(one: tuple[float, float], other: tuple[float, float]) -> float:
    return float(((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2) ** 0.5)
