"""How a real ArduCopter keeps plans: each kind of item that the console offers, fences, rally points, mission files.

`ARDUCOPTER=... pytest tests/real/test_real_plans.py`. With ARDUPILOT_SOURCE set to its source tree, the mission files
of ArduPilot's own tests are included. Neither is part of this repository.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from pymavlink import mavwp
from real.plan_exchange import PlanExchange, plan_exchange

from wire.autopilots.ardupilot_plans import ARDUPILOT_ROOM, ArduPilot
from wire.plan_fields import Effect
from wire.plan_keeping import changes_ahead, differences
from wire.plans import Plan, PlanItem, PlanKind
from wire.transactions import Outcome, PlanUploadWork

SOURCE = "ARDUPILOT_SOURCE"
GOLDEN = Path(__file__).parent.parent / "unit" / "wire" / "golden"
MISSION, FENCE, RALLY = PlanKind.MISSION, PlanKind.FENCE, PlanKind.RALLY
TAKE_OFF = PlanItem(22, 3, z=20.0)
HEADER = "QGC WPL"
SUFFIXES = (".txt", ".waypoints")
COLUMNS = 12
ODD = (0.3, 1.0, 2.5, 17.9, -1.0, -45.5, 100.0, 254.6, 300.7, 2999.0)
LAT, LON = 473_977_000, 85_455_000


def is_taken(kind: PlanKind, item: PlanItem) -> bool:
    return all(one.effect is not Effect.REFUSED for one in changes_ahead(ArduPilot(), kind, [item]))


async def goes_up_and_stays(exchange: PlanExchange, kind: PlanKind, plan: Plan) -> str:
    """Returns the fault, or nothing. The agent has compared the plan; this compares every bit again, later."""
    result = await exchange.do(PlanUploadWork(kind, plan))
    if result.outcome is not Outcome.DONE:
        return result.words
    await asyncio.sleep(0.0 if kind is MISSION else 1.0)
    back = await exchange.read(kind)
    return "; ".join(map(str, differences(ArduPilot(), kind, plan, back, exactly=True)))


async def test_each_kind_of_item_that_the_console_offers_comes_back(arducopter: Path, tmp_path: Path) -> None:
    offered = msgspec.json.decode((GOLDEN / "offered_items.json").read_bytes(), type=dict[str, list[PlanItem]])
    wrong: dict[int, str] = {}
    async with plan_exchange(arducopter, tmp_path) as exchange:
        lacks = exchange.keeping.lacks
        for new in offered["ardupilot"]:
            if new.command in lacks:  # as in the console
                continue
            odd = [
                msgspec.structs.replace(new, params=tuple(params), z=new.z + 0.126 * (new.z > 20))
                for at in range(4)
                for value in ODD
                for params in [[*new.params[:at], value, *new.params[at + 1 :]]]
            ]
            if new.command == 177:
                odd = [msgspec.structs.replace(one, params=(1.0, *one.params[1:])) for one in odd]
            plan = (TAKE_OFF, new, *(one for one in odd if is_taken(MISSION, one)))
            found = await goes_up_and_stays(exchange, MISSION, plan)
            if found:
                wrong[new.command] = found
    assert wrong == {}
    assert len(offered["ardupilot"]) == 33


async def test_each_kind_of_fence_and_a_rally_list_come_back_and_stay(arducopter: Path, tmp_path: Path) -> None:
    def ring(command: int, at: int) -> Plan:
        corners = ((0, 0), (9000, 0), (9000, 9000), (0, 9000))
        return tuple(PlanItem(command, 3, (4.0, 0.0, 0.0, 0.0), LAT + at + x, LON + at + y) for x, y in corners)

    way_back = PlanItem(5000, 3, x=LAT + 5, y=LON + 5)
    into, out = (PlanItem(command, 0, (50.5, 0.0, 0.0, 0.0), LAT, LON) for command in (5003, 5004))
    fences: list[Plan] = [
        ring(5001, 0),
        (into,),
        ring(5002, 90_000),
        (out,),
        (into, out),
        (way_back, *ring(5001, 0), into, out),
        (),
    ]
    rally = tuple(PlanItem(5100, frame, x=LAT + n, y=LON, z=20.9 + n) for n, frame in enumerate((3, 0, 6, 5, 10, 3)))
    async with plan_exchange(arducopter, tmp_path) as exchange:
        for fence in fences:
            assert await goes_up_and_stays(exchange, FENCE, fence) == "", fence
        for points in (rally, rally[:2], ()):
            assert await goes_up_and_stays(exchange, RALLY, points) == "", points


async def test_there_is_room_for_as_many_as_the_table_says_and_no_more(arducopter: Path, tmp_path: Path) -> None:
    def plan(kind: PlanKind, count: int) -> Plan:
        command = {MISSION: 16, FENCE: 5004, RALLY: 5100}[kind]
        return tuple(PlanItem(command, 3, (9.0, 0.0, 0.0, 0.0), LAT + 99 * n, LON, 30.0) for n in range(count))

    async with plan_exchange(arducopter, tmp_path) as exchange:
        for kind in (MISSION, RALLY):
            assert await goes_up_and_stays(exchange, kind, plan(kind, ARDUPILOT_ROOM[kind])) == ""
        for kind in PlanKind:
            refused = await exchange.do(PlanUploadWork(kind, plan(kind, ARDUPILOT_ROOM[kind] + 1)))
            assert (refused.outcome, refused.code) == (Outcome.FAILED, "MAV_MISSION_NO_SPACE"), refused.words
        assert len(await exchange.read(MISSION)) == ARDUPILOT_ROOM[MISSION], "the one before is still there"


async def test_heights_come_back_as_they_were_set(arducopter: Path, tmp_path: Path) -> None:
    heights_m = [n / 100 for n in range(1_000, 13_000, 37)]
    plan = tuple(PlanItem(16, 3, x=LAT + n, y=LON, z=height_m) for n, height_m in enumerate(heights_m))
    async with plan_exchange(arducopter, tmp_path) as exchange:
        assert await goes_up_and_stays(exchange, MISSION, plan) == ""
        assert [round(item.z, 2) for item in await exchange.read(MISSION)] == heights_m


def plan_files(tree: Path) -> Iterator[tuple[Path, PlanKind, Plan]]:
    """Yields ArduPilot's test files that have a header, and twelve columns an item. The first item is home.

    A file of fence items is loaded as a fence.
    """
    for path in sorted((tree / "Tools" / "autotest").rglob("*")):
        if path.suffix not in SUFFIXES:
            continue
        lines = [line for line in path.read_text(errors="replace").splitlines() if line.strip()]
        if not lines or lines[0].split() != [*HEADER.split(), "110"]:
            continue
        rows = [line.split() for line in lines[1:] if not line.lstrip().startswith("#")]
        if all(len(row) == COLUMNS for row in rows):
            plan = tuple(map(_item, rows))
            is_fence = all(item.command in range(5000, 5005) for item in plan[1:])
            home = not is_fence or plan[0].command not in range(5000, 5005)
            yield path, FENCE if is_fence else MISSION, plan[1:] if home else plan


def _item(row: list[str]) -> PlanItem:
    frame, command = int(row[2]), int(row[3])
    p1, p2, p3, p4, x, y, z = (None if value.lower() == "nan" else float(value) for value in row[4:11])
    scale = 1 if frame in (1, 2, 4, 7, 9) or command in (202, 203, 42702, 42703) else 1e7
    first = (p1 or 0.0) - 1.0 if command == 177 else p1
    lat, lon = (round((value or 0.0) * scale) for value in (x, y))
    return PlanItem(command, frame, (first, p2, p3, p4), lat, lon, z or 0.0, int(float(row[11])))


def items_by_its_own_loader(tree: Path) -> dict[Path, int]:
    """Returns how many items, without home, the loader of ArduPilot's tests reads of each file that it can read."""
    found = {}
    for path in sorted((tree / "Tools" / "autotest").rglob("*")):
        if not path.is_file() or not path.read_bytes().startswith(HEADER.encode()):
            continue  # it leaves such files open
        loader = mavwp.MAVWPLoader()
        with contextlib.suppress(mavwp.MAVWPError, UnicodeDecodeError, ValueError, OSError):
            if loader.load(str(path)):
                first = loader.wpoints[0]
                found[path] = len(loader.wpoints) - (first.command not in range(5000, 5005))
    return found


async def test_the_mission_files_of_its_own_tests_come_back(arducopter: Path, tmp_path: Path) -> None:
    tree = os.environ.get(SOURCE)
    if not tree:
        pytest.skip(f"flies ArduPilot's own mission files only where {SOURCE} names its source tree")
    files = list(plan_files(Path(tree)))
    assert files, f"{SOURCE} names {tree}, in which there are none"
    assert {path: len(plan) for path, _, plan in files} == items_by_its_own_loader(Path(tree))
    wrong: dict[str, str] = {}
    async with plan_exchange(arducopter, tmp_path) as exchange:
        for path, kind, plan in files:
            found = await goes_up_and_stays(exchange, kind, plan)
            if found:
                wrong[path.name] = found
    assert wrong == {}, f"{len(files) - len(wrong)} of {len(files)} files"
