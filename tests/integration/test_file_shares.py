"""A tenant announces huge files or sends many: the other tenant's files stay, up to their share."""

import os
import secrets
from collections.abc import Mapping
from datetime import timedelta
from pathlib import Path
from typing import Final

import pytest
from sqlalchemy import func, select
from tower_world import NewDrone, TowerWorld, start_tower

from server.logs.store.quota import ArrivingLog, FlightLogQuota
from server.storage.file_budget import NOBODY, Account, StorageFull, to_shrink
from server.video.store.tables import RecordingRow
from wire.ids import DroneId

ALICE, MALLORY = 1, 2
HERS, HIS, HIS_OTHER, NOBODYS = DroneId(1), DroneId(2), DroneId(3), DroneId(9)
ACCOUNTS: Final[Mapping[int, Account]] = {HERS: ALICE, HIS: MALLORY, HIS_OTHER: MALLORY}
BUDGET: Final = 1000


def quota(root: Path) -> FlightLogQuota:
    return FlightLogQuota(root / "files", budget_bytes=BUDGET, largest_bytes=BUDGET)


def put(on: FlightLogQuota, drone: DroneId, log_id: int, size: int, *, at: float) -> None:
    arriving = on.begin(drone, log_id, size, 1, ACCOUNTS)
    try:
        for start in range(0, size, 100):
            on.write(arriving, b"x" * min(100, size - start))
        arriving.file.close()
        os.utime(arriving.path, (at, at))
        on.keep(arriving, log_id, 5)
    finally:
        on.discard(arriving)


def kept(on: FlightLogQuota, drone: DroneId) -> list[int]:
    return sorted(one.log_id for one in on.of(drone))


def test_a_promise_takes_nothing_from_anybody(tmp_path: Path) -> None:
    on = quota(tmp_path)
    for log_id in range(9):
        put(on, HERS, log_id, 100, at=1000 + log_id)
    promised: list[ArrivingLog] = [on.begin(HIS, 50 + n, BUDGET, 1, ACCOUNTS) for n in range(20)]
    assert kept(on, HERS) == list(range(9)), "nothing came, nothing goes"
    for one in promised:
        on.discard(one)
    assert kept(on, HERS) == list(range(9))


def test_a_flood_ends_at_the_share_of_the_other(tmp_path: Path) -> None:
    """Her files are the oldest and exceed her share: she loses only the excess."""
    on = quota(tmp_path)
    for log_id in range(8):
        put(on, HERS, log_id, 100, at=1000 + log_id)
    for log_id in range(100):
        put(on, HIS if log_id % 2 else HIS_OTHER, log_id, 100, at=2000 + log_id)
    assert kept(on, HERS) == [3, 4, 5, 6, 7]
    assert sorted(kept(on, HIS) + kept(on, HIS_OTHER)) == [95, 96, 97, 98, 99], "of his own the oldest go"


def test_many_files_at_one_time_take_nothing_either_and_are_refused(tmp_path: Path) -> None:
    on = quota(tmp_path)
    for log_id in range(5):
        put(on, HERS, log_id, 100, at=1000 + log_id)
    arriving = [on.begin(HIS, 50 + n, BUDGET, 1, ACCOUNTS) for n in range(4)]
    refused = 0
    for _ in range(10):
        for one in arriving:
            try:
                on.write(one, b"x" * 100)
            except StorageFull:
                refused += 1
                one.arrived_bytes -= 100  # it is not on the disk
    assert refused == 35
    assert kept(on, HERS) == list(range(5))
    put(on, HERS, 7, 100, at=5000)
    assert kept(on, HERS) == [1, 2, 3, 4, 7], "at her share, her own oldest one goes"
    for one in arriving:
        on.discard(one)


def test_who_is_within_their_share_may_go_on_sending_while_somebody_else_takes_too_much(tmp_path: Path) -> None:
    on = quota(tmp_path)
    his = on.begin(HIS, 1, BUDGET, 1, ACCOUNTS)
    on.write(his, b"x" * BUDGET)
    put(on, HERS, 1, 300, at=1000)
    assert kept(on, HERS) == [1]
    with pytest.raises(StorageFull):
        on.write(his, b"x")
    on.discard(his)


def test_files_of_nobody_have_a_share_of_their_own(tmp_path: Path) -> None:
    on = quota(tmp_path)
    put(on, NOBODYS, 1, 300, at=1)
    for log_id in range(12):
        put(on, HIS, log_id, 100, at=2000 + log_id)
    assert kept(on, NOBODYS) == [1]
    assert kept(on, HIS) == list(range(5, 12))


@pytest.mark.parametrize(
    ("used", "removable", "coming", "expected"),
    [
        ({ALICE: 900, MALLORY: 200}, {ALICE: 900}, MALLORY, ALICE),
        ({ALICE: 500, MALLORY: 600}, {ALICE: 500}, MALLORY, None),
        ({ALICE: 500, MALLORY: 600}, {ALICE: 500, MALLORY: 10}, MALLORY, MALLORY),
        ({ALICE: 600, MALLORY: 700}, {ALICE: 600}, MALLORY, None),
        ({ALICE: 600, MALLORY: 600}, {ALICE: 600, MALLORY: 600}, MALLORY, MALLORY),
        ({ALICE: 400, MALLORY: 700}, {ALICE: 400}, ALICE, None),
        ({ALICE: 1100}, {ALICE: 100}, ALICE, ALICE),
        ({ALICE: 1100}, {}, ALICE, None),
        ({ALICE: 300, MALLORY: 300, NOBODY: 500}, {NOBODY: 500}, ALICE, NOBODY),
    ],
)
def test_whose_file_goes(
    used: dict[Account, int], removable: dict[Account, int], coming: Account, expected: Account | None
) -> None:
    assert to_shrink(used, removable, coming=coming, budget_bytes=BUDGET) == expected


# -- recordings, with a real tower -----------------------------------------------------------------------------


async def add_recordings(world: TowerWorld, drone: NewDrone, count: int, size: int, *, age_h: float) -> None:
    async with world.database.writing() as session:
        for number in range(count):
            session.add(
                RecordingRow(
                    drone_id=drone.id,
                    store=world.tower.recordings.store.id,
                    file=secrets.token_hex(8),
                    by_name="somebody",
                    quality="high",
                    codec="h264",
                    state="ready",
                    began_at=world.clock() - timedelta(hours=age_h, seconds=-number),
                    size_bytes=size,
                )
            )


async def count_of(world: TowerWorld, drone: NewDrone) -> int:
    async with world.database.reading() as session:
        query = select(func.count()).select_from(RecordingRow).where(RecordingRow.drone_id == drone.id)
        return int(await session.scalar(query) or 0)


async def test_recordings_of_one_tenant_do_not_push_out_those_of_another(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        alice, mallory = await world.add_user("Alice"), await world.add_user("Mallory")
        hers, his = await world.add_drone("hers", alice), await world.add_drone("his", mallory)
        quota = world.tower.recordings.quota
        quota.budget_bytes = BUDGET
        await add_recordings(world, hers, 4, 100, age_h=48)  # the oldest of all
        await add_recordings(world, his, 6, 100, age_h=2)
        for _ in range(20):
            assert await quota.make_space(100, his.id)
            await add_recordings(world, his, 1, 100, age_h=1)
        assert (await count_of(world, hers), await count_of(world, his)) == (4, 6)
        # His running and announced recordings do not reduce hers, and hers continue when he exceeds his share.
        quota.in_use = lambda: {his.id: 5 * BUDGET}
        assert not await quota.make_space(1, his.id)
        assert await count_of(world, hers) == 4
        assert await quota.make_space(100, hers.id)
        assert await count_of(world, hers) == 4
        assert quota.hogs_most(his.id) > quota.hogs_most(hers.id)
