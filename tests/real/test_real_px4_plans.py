"""How a real PX4 keeps plans: each kind of item that the console offers, fences, rally points, and its capacity.

`PX4=... pytest tests/real/test_real_px4_plans.py`.
"""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator
from pathlib import Path

import msgspec
from real.plan_exchange import PlanExchange

from bench.real_px4 import flying_px4
from wire.autopilots.px4_plans import PX4_ROOM, Px4
from wire.plan_fields import Effect
from wire.plan_keeping import changes_ahead, differences
from wire.plans import Plan, PlanItem, PlanKind
from wire.transactions import Outcome, PlanUploadWork

GOLDEN = Path(__file__).parent.parent / "unit" / "wire" / "golden"
MISSION, FENCE, RALLY = PlanKind.MISSION, PlanKind.FENCE, PlanKind.RALLY
TAKE_OFF = PlanItem(22, 3, z=20.0)
ODD = (0.3, 1.0, 2.5, 17.9, -1.0, -45.5, 100.0, 254.6, 300.7, 2999.0, None)
LAT, LON = 473_977_000, 85_455_000
REFUSED_AT_ALL = {18, 82, 115, 181, 183}
"""Items offered for ArduPilot only. PX4 also accepts delays (112, 114), and a home (179) or a landing start (189)
without a position, but flies none of them in a mission, so the console does not offer them."""


@contextlib.asynccontextmanager
async def exchange_with(build: Path, folder: Path) -> AsyncIterator[PlanExchange]:
    async with flying_px4(build, folder) as autopilot:
        yield PlanExchange(autopilot, Px4())


def offered() -> dict[str, list[PlanItem]]:
    return msgspec.json.decode((GOLDEN / "offered_items.json").read_bytes(), type=dict[str, list[PlanItem]])


def is_taken(item: PlanItem) -> bool:
    return all(one.effect is not Effect.REFUSED for one in changes_ahead(Px4(), MISSION, [item]))


async def goes_up_and_stays(exchange: PlanExchange, kind: PlanKind, plan: Plan) -> str:
    """Returns the fault, or nothing."""
    result = await exchange.do(PlanUploadWork(kind, plan))
    if result.outcome is not Outcome.DONE:
        return result.words
    return "; ".join(map(str, differences(Px4(), kind, plan, await exchange.read(kind), exactly=True)))


async def test_each_kind_of_item_that_the_console_offers_comes_back(px4_build: Path, tmp_path: Path) -> None:
    wrong: dict[int, str] = {}
    async with exchange_with(px4_build, tmp_path) as exchange:
        for new in offered()["px4"]:
            odd = [
                msgspec.structs.replace(new, params=tuple(params), z=new.z + 0.126 * (new.z > 20))
                for at in range(4)
                for value in ODD
                for params in [[*new.params[:at], value, *new.params[at + 1 :]]]
            ]
            if new.command == 177:
                odd = [msgspec.structs.replace(one, params=(1.0, *one.params[1:])) for one in odd]
            found = await goes_up_and_stays(exchange, MISSION, (TAKE_OFF, new, *filter(is_taken, odd)))
            if found:
                wrong[new.command] = found
    assert wrong == {}
    assert len(offered()["px4"]) == 25


async def test_what_it_cannot_do_is_refused_and_not_offered(px4_build: Path, tmp_path: Path) -> None:
    kinds = offered()
    ours = {item.command for item in kinds["px4"]}
    refused: set[int] = set()
    async with exchange_with(px4_build, tmp_path) as exchange:
        for item in kinds["ardupilot"]:
            if item.command in ours:
                continue
            reported = [
                await exchange.do(PlanUploadWork(MISSION, (TAKE_OFF, one))) for one in (item, placed_nowhere(item))
            ]
            assert {one.code for one in reported if one.outcome is Outcome.FAILED} <= {"MAV_MISSION_UNSUPPORTED"}
            if all(one.outcome is Outcome.FAILED for one in reported):
                refused.add(item.command)
    assert refused == REFUSED_AT_ALL
    assert not refused & ours


def placed_nowhere(item: PlanItem) -> PlanItem:
    return msgspec.structs.replace(item, frame=2)


async def test_each_kind_of_fence_and_a_rally_list_come_back(px4_build: Path, tmp_path: Path) -> None:
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
    rally = tuple(PlanItem(5100, frame, x=LAT + n, y=LON, z=20.9 + n) for n, frame in enumerate((3, 0, 6, 5, 3)))
    async with exchange_with(px4_build, tmp_path) as exchange:
        for fence in fences:
            assert await goes_up_and_stays(exchange, FENCE, fence) == "", fence
        for points in (rally, rally[:2], ()):
            assert await goes_up_and_stays(exchange, RALLY, points) == "", points


async def test_there_is_room_for_as_many_as_the_table_says_and_no_more(px4_build: Path, tmp_path: Path) -> None:
    def plan(kind: PlanKind, count: int) -> Plan:
        command = {MISSION: 16, FENCE: 5004, RALLY: 5100}[kind]
        return tuple(PlanItem(command, 3, (9.0, 0.0, 0.0, 0.0), LAT + 99 * n, LON, 30.0) for n in range(count))

    async with exchange_with(px4_build, tmp_path) as exchange:
        for kind in PlanKind:
            assert await goes_up_and_stays(exchange, kind, plan(kind, PX4_ROOM[kind])) == ""
        for kind in (FENCE, RALLY):
            refused = await exchange.do(PlanUploadWork(kind, plan(kind, PX4_ROOM[kind] + 1)))
            assert (refused.outcome, refused.code) == (Outcome.FAILED, "MAV_MISSION_NO_SPACE"), refused.words
            assert len(await exchange.read(kind)) == PX4_ROOM[kind], "the one before is still there"
