"""Two towers on one PostgreSQL and one NATS: a drone at one of them, its people at the other."""

import asyncio
import json
import time
from pathlib import Path

import msgspec
import pytest
import shared_bus_world
from control_world import ObedientAgent, ask, audit, until
from own_postgres import OwnPostgres
from shared_bus_world import AUTOPILOT, Two, frame_of
from sqlalchemy import select, update
from tower_world import assert_problem, start_tower
from worlds.nats import TemporaryNats

from server.kernel.clock import utc_now
from server.storage.database import open_database
from server.storage.schema import migrate
from server.towers.core.place import Place
from server.towers.core.tower_lease import LockWatch
from server.towers.store.membership import TowerMembership
from server.towers.store.tables import TowerMemberRow
from server.towers.store.tower_lock import TowerLockHeld
from server.towers.store.tower_lock_tables import TowerLockRow
from wire.content import Frames
from wire.dialect import mavlink
from wire.ids import DroneId, Epoch
from wire.tagged import split_tagged

cluster, nats = shared_bus_world.cluster, shared_bus_world.nats
postgres, two = shared_bus_world.postgres, shared_bus_world.two

FROZEN_S = 4.0
"""Longer than a tower may be silent before another one may declare it dead (`LEASE_S`, `TAKE_AFTER_S`)."""


async def test_a_drone_of_one_tower_is_flown_from_another(two: Two) -> None:
    drone_id = two.drone.id
    listed = (await two.alice.get("/api/v1/drones")).json()
    assert [(one["id"], one["online"], one["airborne"]) for one in listed] == [(drone_id, True, True)]
    answer = await ask(two.alice, drone_id, "acquire")
    assert answer.status_code == 200, answer.text
    assert answer.json()["holder"]["name"] == "Alice"
    assert two.at(two.a).holder_id == answer.json()["holder"]["id"]
    assert two.at(two.a).somebody_flies(), "she is present at the drone's tower"
    await two.alices.event("control", event="acquired")

    # Up: frames reach her browser, conflated for one that watches and at once for one in focus.
    attitude = frame_of(mavlink.MAVLink_attitude_message(1, 0.1, 0.2, 0.3, 0, 0, 0), AUTOPILOT)
    await two.alices.socket.send(json.dumps({"type": "focus", "drone_id": drone_id}))
    await until("focus", lambda: any(b.outbox.focus == drone_id for b in two.at(two.a).watchers.values()))
    began = time.monotonic()
    two.a.tower.hub._paths.up(two.at(two.a), Frames(DroneId(drone_id), Epoch(1), 0, [attitude]), time.monotonic())
    got = b""
    async with asyncio.timeout(10):
        while not got:
            message = await two.alices.socket.recv()
            got = message if isinstance(message, bytes) else b""
    print(f"a frame from tower to tower to browser: {1000 * (time.monotonic() - began):.1f} ms")
    assert split_tagged(got) == [(drone_id, attitude)]

    # Down: her sticks pass at the drone's tower, under its judgement.
    before = two.a.tower.hub.state.traffic.frames_to_agents
    await two.sticks()
    await until("her sticks", lambda: two.a.tower.hub.state.traffic.frames_to_agents > before)
    assert two.at(two.a).flown_by_hand(time.monotonic())
    assert two.b.tower.hub.state.traffic.frames_to_agents == 0


async def test_a_take_from_another_tower_is_done_when_the_drone_was_ordered_to_hold(two: Two) -> None:
    drone_id = two.drone.id
    assert (await ask(two.alice, drone_id, "acquire")).status_code == 200
    await two.sticks()
    await until("her sticks", lambda: two.at(two.a).flown_by_hand(time.monotonic()))
    holds = len(two.agent.holds)
    took = await ask(two.root, drone_id, "take", reason="test")
    assert took.status_code == 200, took.text
    assert len(two.agent.holds) > holds, "the order went out before the answer"
    assert took.json()["holder"]["name"] == "Root"
    passed = two.a.tower.hub.state.traffic.frames_to_agents
    await two.sticks(900)
    await two.alices.event("notice")
    assert two.a.tower.hub.state.traffic.frames_to_agents == passed, "her sticks pass no more"
    await two.alices.event("control", event="taken")
    await two.alices.event("hold", step="confirmed")
    rows = await audit(two.root, "control.take")
    assert [row["detail"]["result"] for row in rows] == ["done"]
    assert rows[0]["request_id"] == took.headers["x-request-id"]
    shown = (await two.root.get("/metrics")).text
    assert "tower_bus_connected 1.0" in shown
    assert 'tower_drone_homes{place="elsewhere"} 1.0' in shown
    assert 'tower_other_towers{state="heard"} 1.0' in shown


async def test_signing_out_at_one_tower_ends_the_controls_at_another(two: Two) -> None:
    assert (await ask(two.alice, two.drone.id, "acquire")).status_code == 200
    await two.sticks()
    await until("her sticks", lambda: two.at(two.a).flown_by_hand(time.monotonic()))
    holds = len(two.agent.holds)
    assert (await two.alice.delete("/api/v1/session")).status_code == 204
    await until("the lease to end", lambda: two.at(two.a).lease.holder is None)
    assert len(two.agent.holds) > holds


async def test_without_the_bus_who_flies_from_afar_counts_as_gone(two: Two, nats: TemporaryNats) -> None:
    drone_id = two.drone.id
    assert (await ask(two.alice, drone_id, "acquire")).status_code == 200
    await two.sticks()
    await until("her sticks", lambda: two.at(two.a).flown_by_hand(time.monotonic()))
    holds, epoch = len(two.agent.holds), two.at(two.a).lease.epoch
    nats.kill()
    killed_at = time.monotonic()
    try:
        await until("her absence to be noticed", lambda: not two.at(two.a).somebody_flies())
        print(f"absence noticed after {time.monotonic() - killed_at:.2f} s")
        await until("the hold", lambda: len(two.agent.holds) > holds)
        print(f"hold ordered after {time.monotonic() - killed_at:.2f} s")
        assert (two.at(two.a).lease.epoch, two.at(two.a).holder_id) == (epoch, two.at(two.a).holder_id)
        await until("b to notice", lambda: two.at(two.b).place is Place.OUT_OF_REACH)
        assert_problem(await ask(two.root, drone_id, "take"), 503, "tower-out-of-reach")
        shown = (await two.alice.get(f"/api/v1/drones/{drone_id}")).json()
        assert shown["online"] is False
    finally:
        nats.start()
    await until("the bus to be back", lambda: two.at(two.b).place is Place.ELSEWHERE)
    await until("her presence", lambda: two.at(two.a).somebody_flies())
    assert (await ask(two.root, drone_id, "take")).status_code == 200


async def test_without_the_database_who_flies_goes_on_flying(two: Two, postgres: OwnPostgres) -> None:
    drone_id = two.drone.id
    assert (await ask(two.alice, drone_id, "acquire")).status_code == 200
    await two.sticks()
    await until("her sticks", lambda: two.at(two.a).flown_by_hand(time.monotonic()))
    assert (await two.root.get("/api/v1/users")).status_code == 200, "b knows him now"
    fleet = two.a.tower.hub.fleet
    sessions = [one["id"] for one in (await two.root.get("/api/v1/sessions")).json()]
    await until("a to have looked his session up", lambda: all(fleet.knows_sign_in(one) for one in sessions))
    holds = len(two.agent.holds)
    drone = two.at(two.a)
    drone.safety = msgspec.structs.replace(drone.safety, rtt_limit_ms=60_000)  # this agent answers no pings
    postgres.freeze()
    try:
        frozen_at, sent = time.monotonic(), 0
        passed = two.a.tower.hub.state.traffic.frames_to_agents
        while time.monotonic() < frozen_at + FROZEN_S:
            await two.sticks(sent % 500)
            sent += 1
            await two.answer_pings_for(0.1)
        await until("her last sticks", lambda: two.a.tower.hub.state.traffic.frames_to_agents == passed + sent)
        assert two.pings, "the drone's tower measures her round trip"
        assert len(two.agent.holds) == holds, "nobody made it hold"
        assert not two.a.tower.lock.is_renewed
        refused = await ask(two.root, drone_id, "take")
        assert refused.status_code == 503, refused.text
        assert len(two.agent.holds) > holds, "a TAKE that nobody decides makes the drone hold"
    finally:
        postgres.thaw()
    await until("the database to be back", lambda: two.a.tower.lock.is_renewed and two.b.tower.lock.is_renewed)
    assert two.a.tower.lock.may_act() and two.b.tower.lock.may_act(), "nobody was declared dead"
    await until("the fence to be lifted", lambda: not two.at(two.a).fenced)
    assert two.at(two.a).lease.holder is not None
    async with asyncio.timeout(20):
        while (await ask(two.root, drone_id, "take")).status_code == 503:  # noqa: ASYNC110  # broken connections are replaced
            await asyncio.sleep(0.05)
    assert two.at(two.a).lease.taken_from is not None


async def test_a_drone_that_links_elsewhere_moves_its_home_and_holds(two: Two) -> None:
    drone_id = two.drone.id
    assert (await ask(two.alice, drone_id, "acquire")).status_code == 200
    epoch = two.at(two.a).lease.epoch
    moved = ObedientAgent(two.b.tower.hub, drone_id)
    assert two.at(two.b).fenced, "no commands pass before the claim"
    moved.state(armed=True, airborne=True)
    await until("the new home", lambda: two.at(two.b).place is Place.HERE)
    await until("a to know", lambda: two.at(two.a).place is Place.ELSEWHERE)
    assert two.at(two.a).link is None
    assert moved.holds, "what was flown elsewhere is not known here"
    assert (two.at(two.b).lease.epoch, two.at(two.b).lease.holder is not None) == (epoch, True)
    await until("the fence to be lifted", lambda: not two.at(two.b).fenced)
    assert (await ask(two.root, drone_id, "take")).status_code == 200
    assert moved.holds[-1].reason


async def test_a_tower_without_a_bus_is_refused(two: Two, tmp_path: Path, postgres: OwnPostgres) -> None:
    alone = tmp_path / "alone"
    alone.mkdir()
    url = postgres.url.replace("postgresql://", "postgresql+asyncpg://")
    with pytest.raises(TowerLockHeld, match="several towers that share a bus"):
        async with start_tower(alone, database_url=url, secret_keys=two.a.settings.secret_keys):
            pass


async def test_a_tower_joins_again_whose_first_answer_was_lost(postgres: OwnPostgres) -> None:
    """Found on a busy machine: the row was there already, and the tower did not start."""
    url = postgres.url.replace("postgresql://", "postgresql+asyncpg://")
    database = open_database(url)
    await migrate(database)
    await database.close()
    membership = TowerMembership(url, clock=utc_now)
    try:
        await membership._join(LockWatch())
        await membership.take(waits=False)
        assert membership.may_act()
    finally:
        await membership.release()


async def test_a_renewal_counts_in_both_rows_and_in_none_once_a_tower_without_a_bus_has_the_database(
    postgres: OwnPostgres,
) -> None:
    url = postgres.url.replace("postgresql://", "postgresql+asyncpg://")
    database = open_database(url)
    await migrate(database)
    membership = TowerMembership(url, clock=utc_now)

    async def renewals() -> tuple[int, int]:
        async with database.reading() as session:
            mine = select(TowerMemberRow.renewals).where(TowerMemberRow.tower == membership.tower)
            common = select(TowerLockRow.renewals)
            return (await session.scalars(mine)).one(), (await session.scalars(common)).one()

    try:
        await membership.take(waits=False)
        mine, common = await renewals()
        assert await membership._renew_once()
        assert await renewals() == (mine + 1, common + 1)
        assert [one.tower for one in membership.present] == [membership.tower]

        async with database.writing() as session:
            await session.execute(update(TowerLockRow).values(owner="of another tower"))
        assert not await membership._renew_once()
        assert await renewals() == (mine + 1, common + 1)
        assert not membership.may_act()
        assert membership.lost_words
    finally:
        await membership.release()
        await database.close()


async def test_towers_that_renew_at_the_same_moment_all_renew(postgres: OwnPostgres) -> None:
    """Who waits for the common row checks it again once it is free (READ COMMITTED), and not its own row."""
    url = postgres.url.replace("postgresql://", "postgresql+asyncpg://")
    database = open_database(url)
    await migrate(database)
    towers = [TowerMembership(url, clock=utc_now) for _ in range(3)]

    async def renewals() -> int:
        async with database.reading() as session:
            return (await session.scalars(select(TowerLockRow.renewals))).one()

    try:
        for one in towers:
            await one.take(waits=False)
        before = await renewals()
        async with database.writing() as session:
            await session.execute(update(TowerLockRow).values(renewals=TowerLockRow.renewals + 1))
            waiting = [asyncio.create_task(one._write_renewal()) for one in towers]
            await asyncio.wait(waiting, timeout=0.2)
            assert not any(one.done() for one in waiting)
        for found in await asyncio.gather(*waiting):
            assert found is not None
            assert {one.tower for one in found} == {one.tower for one in towers}
        assert await renewals() == before + 1 + len(towers)
    finally:
        for one in towers:
            await one.release()
        await database.close()
