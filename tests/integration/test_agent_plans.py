"""Plans at the drone with real parts: a simulator process, an agent process, sockets, and the journal on disk."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import sys
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from agent_fakes import FakeTower, keep_key, running_tower, until
from worlds.free_ports import free_udp_ports

from wire.autopilots.ardupilot_plans import ArduPilot
from wire.autopilots.px4_plans import Px4
from wire.control_messages import ToTower
from wire.dialect import build, decode, mavlink
from wire.plan_keeping import as_kept
from wire.plans import Plan, PlanItem, PlanKind, pack_plan, plan_hash
from wire.transactions import (
    TRANSACTIONS,
    CommandWork,
    Outcome,
    PlanDownloadWork,
    PlanOnBoard,
    PlanUploadWork,
    Transaction,
    TransactionProgress,
    TransactionResult,
)

MISSION = PlanKind.MISSION
BIN = Path(sys.executable).parent
STARTED_WITHIN_S = 30.0


def waypoints(count: int, alt_m: float) -> Plan:
    return tuple(PlanItem(16, 3, (0.0, 0.0, 0.0, 0.0), 473977000 + i * 100, 85456000, alt_m) for i in range(count))


NEW = waypoints(200, 60.0)
SHORT, LONGER = waypoints(30, 30.0), waypoints(200, 60.0)  # long enough to report some progress


class DroneWithPlans:
    """A simulator and an agent as processes, and a tower that gives them work."""

    def __init__(self, tower: FakeTower, folder: Path, flavour: str) -> None:
        self.tower = tower
        self._folder = folder
        self._flavour = flavour
        (self._port,) = free_udp_ports(1)
        self._processes: list[asyncio.subprocess.Process] = []
        self._ids = itertools.count(1)
        self.agent: asyncio.subprocess.Process | None = None
        token = folder / "token"
        keep_key(token)

    async def start_simulator(self) -> None:
        await self._start(
            *("tower-sim", "--home", "47.3977,8.5456,488,0", "--out", f"udp:127.0.0.1:{self._port}"),
            *("--flavour", self._flavour, "--boot-s", "1", "--fail", "mission-written-in-place"),
        )

    async def start_agent(self) -> None:
        self.agent = await self._start(
            *("tower-agent", "run", "--tower", f"http://127.0.0.1:{self.tower.port}"),
            *("--token", str(self._folder / "token"), "--autopilot", f"udpin:127.0.0.1:{self._port}"),
            *("--state", str(self._folder / "state")),
        )

    async def _start(self, name: str, *arguments: str) -> asyncio.subprocess.Process:
        log = (self._folder / f"{name}.log").open("ab")
        with log:
            process = await asyncio.create_subprocess_exec(str(BIN / name), *arguments, stdout=log, stderr=log)
        self._processes.append(process)
        return process

    async def end(self) -> None:
        for process in self._processes:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()

    async def kill_agent(self) -> None:
        assert self.agent is not None
        self.agent.kill()
        await self.agent.wait()

    @property
    def journal(self) -> Path:
        return self._folder / "state" / "drone-7" / "plans" / "mission.intent"

    def on_board(self, kind: PlanKind = MISSION, since: int = 0) -> PlanOnBoard | None:
        """Returns the latest report, if there is one."""
        reported = [one for one in self.tower.messages[since:] if isinstance(one, PlanOnBoard) and one.kind == kind]
        return reported[-1] if reported else None

    def kept(self, plan: Plan) -> Plan:
        """Returns the plan as this autopilot keeps it."""
        return as_kept(ArduPilot() if self._flavour == "ardupilot" else Px4(), MISSION, plan)

    async def knows(self, plan: Plan, *, since: int = 0, timeout_s: float = STARTED_WITHIN_S) -> PlanOnBoard:
        wanted = plan_hash(MISSION, self.kept(plan))
        await until(
            lambda: (reported := self.on_board(since=since)) and reported.hash == wanted,
            timeout_s,
            f"{len(plan)} items",
        )
        reported = self.on_board()
        assert reported is not None
        return reported

    async def begin(self, work: Any) -> int:
        number = next(self._ids)
        await self.tower.announce(Transaction(id=number, epoch=self.tower.epoch, deadline_s=60.0, work=work))
        return number

    async def result(self, number: int) -> TransactionResult:
        def results() -> list[ToTower]:
            return [one for one in self.tower.messages if isinstance(one, TransactionResult) and one.id == number]

        (found,) = await until(results, 60.0, f"the result of {number}")
        assert isinstance(found, TransactionResult)
        return found

    async def do(self, work: Any) -> TransactionResult:
        return await self.result(await self.begin(work))

    async def writing(self, number: int, items: int) -> None:
        """Waits until the upload has sent this many items."""

        def so_many() -> bool:
            reported = (one for one in self.tower.messages if isinstance(one, TransactionProgress) and one.id == number)
            return any(one.phase == "writing" and one.done >= items for one in reported)

        await until(so_many, 30.0, f"{items} items are written")

    def said(self, name: str, **fields: Any) -> list[Any]:
        """Returns the autopilot's frames that were received with these fields."""
        messages = (message for message in map(decode, self.tower.frames) if message is not None)
        return [
            one
            for one in messages
            if one.get_type() == name and all(getattr(one, field) == value for field, value in fields.items())
        ]


@pytest.fixture(params=["ardupilot", "px4"])
async def drone(request: pytest.FixtureRequest, tmp_path: Path) -> AsyncIterator[DroneWithPlans]:
    async with running_tower() as tower:
        tower.takes = (TRANSACTIONS,)
        world = DroneWithPlans(tower, tmp_path, request.param)
        try:
            await world.start_simulator()
            await world.start_agent()
            await tower.linked(timeout_s=STARTED_WITHIN_S)
            await world.knows(())
            yield world
        finally:
            await world.end()


def from_ground_station(message: Any) -> bytes:
    return build(message, system_id=255, component_id=190, sequence=0)


async def test_a_plan_goes_up_is_read_back_and_a_foreign_one_is_noticed(drone: DroneWithPlans) -> None:
    assert TRANSACTIONS in drone.tower.hellos[0].takes
    result = await drone.do(PlanUploadWork(MISSION, NEW))
    assert result.outcome is Outcome.DONE, result.words
    reported = await drone.knows(NEW)
    assert (reported.count, reported.plan, reported.fit_to_fly) == (200, pack_plan(MISSION, drone.kept(NEW)), True)
    assert (await drone.do(PlanDownloadWork(MISSION))).plan == pack_plan(MISSION, drone.kept(NEW))
    assert not drone.journal.exists()
    assert not drone.said("MISSION_ITEM_INT"), "the agent's own transfers do not go up"

    foreign = waypoints(2, 45.0)
    home = (PlanItem(16, 0),) if drone._flavour == "ardupilot" else ()
    items = (*home, *foreign)
    before = len(drone.tower.messages)
    drone.tower.send_frames(from_ground_station(mavlink.MAVLink_mission_count_message(1, 1, len(items), 0)))
    await until(lambda: (reported := drone.on_board(since=before)) and reported.hash is None, 2.0, "not known any more")
    for seq, item in enumerate(items):
        await until(lambda seq=seq: drone.said("MISSION_REQUEST_INT", target_system=255, seq=seq))  # type: ignore[misc]
        fields = (item.frame, item.command, 0, 1, 0, 0, 0, 0, item.x, item.y, item.z, 0)
        drone.tower.send_frames(from_ground_station(mavlink.MAVLink_mission_item_int_message(1, 1, seq, *fields)))
    await until(lambda: drone.said("MISSION_ACK", target_system=255, type=0), what="the ground station has its answer")
    await drone.knows(foreign, since=before, timeout_s=10.0)


async def test_no_mission_is_started_and_nobody_else_writes_while_a_plan_is_written(drone: DroneWithPlans) -> None:
    number = await drone.begin(PlanUploadWork(MISSION, NEW))
    await drone.writing(number, 1)
    drone.tower.send_frames(
        from_ground_station(mavlink.MAVLink_command_long_message(1, 1, 300, 0, 0, 0, 0, 0, 0, 0, 0)),
        from_ground_station(mavlink.MAVLink_mission_clear_all_message(1, 1, 0)),
    )
    refused = await drone.do(CommandWork(command=mavlink.MAV_CMD_MISSION_START))
    assert (refused.outcome, "is being written" in refused.words) == (Outcome.REFUSED, True)
    await until(lambda: drone.said("COMMAND_ACK", command=300, result=mavlink.MAV_RESULT_DENIED, target_system=255))
    await until(lambda: [one for one in drone.said("STATUSTEXT", severity=4) if "being written" in one.text])
    assert (await drone.result(number)).outcome is Outcome.DONE
    await drone.knows(NEW)


async def test_an_agent_that_is_killed_in_a_write_leaves_a_whole_plan_and_says_so(drone: DroneWithPlans) -> None:
    assert (await drone.do(PlanUploadWork(MISSION, SHORT))).outcome is Outcome.DONE
    for items in (1, 20):
        number = await drone.begin(PlanUploadWork(MISSION, LONGER))
        await drone.writing(number, items)
        await drone.kill_agent()
        assert drone.journal.exists()
        before = len(drone.tower.messages)
        hellos = len(drone.tower.hellos)
        await drone.start_agent()
        await drone.tower.linked(hellos + 1, timeout_s=STARTED_WITHIN_S)
        refused = await drone.do(CommandWork(command=mavlink.MAV_CMD_MISSION_START))
        reported = await drone.knows(SHORT, since=before)
        assert reported.fit_to_fly
        assert refused.outcome is Outcome.REFUSED
        await until(lambda: not drone.journal.exists(), what="the journal is removed")
        assert (await drone.do(PlanDownloadWork(MISSION))).plan == pack_plan(MISSION, drone.kept(SHORT))
    assert drone.tower.hellos[-1].process not in (0, drone.tower.hellos[0].process)
    assert (await drone.do(PlanUploadWork(MISSION, LONGER))).outcome is Outcome.DONE
