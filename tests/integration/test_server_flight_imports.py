"""Flight files of other programs over REST: who may have them, what is refused, and what they leave behind."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, Final

import httpx
import pytest
from tower_world import TowerWorld, assert_problem, start_tower
from worlds.flight_files import telemetry_log
from worlds.foreign_logs import BEGAN_S, dataflash_log, ulog_log

from server.flights.core.imports.converted import Converted
from server.flights.store.imports.converting import run_converter
from server.flights.store.imports.service import FlightImports
from server.kernel.people import Role
from server.kernel.shares import ShareName

PATH: Final = "/api/v1/flight-imports"
RAW: Final = {"Content-Type": "application/octet-stream"}


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path, flight_import_largest_mb=1, flight_imports_budget_mb=1) as running:
        yield running


async def sent(client: httpx.AsyncClient, log: bytes, name: str = "") -> httpx.Response:
    return await client.post(PATH, params={"name": name}, content=log, headers=RAW, timeout=60)


def left_behind(world: TowerWorld) -> list[str]:
    return sorted(path.suffix for path in (world.settings.files / "flight-imports").glob("user-*/*"))


async def test_each_kind_of_file_becomes_a_flight_of_its_uploader(world: TowerWorld) -> None:
    alice = await world.signed_in(await world.add_user("alice"))
    logs = {"dataflash": dataflash_log(20), "ulog": ulog_log(20), "tlog": telemetry_log(BEGAN_S, 20.0, 10)}
    for kind, log in logs.items():
        answer = await sent(alice, log, f"00000001.{kind}")
        assert answer.status_code == 201, answer.text
        assert (answer.json()["format"], answer.json()["name"]) == (kind, f"00000001.{kind}")
    listed: list[dict[str, Any]] = (await alice.get(PATH)).json()
    assert [one["format"] for one in listed] == ["tlog", "ulog", "dataflash"]
    for one in listed:
        assert one["by"]["name"] == "alice"
        assert one["clock_known"] is True
        assert 17 < one["duration_s"] < 21
        assert len(one["track"]) > 5
        assert (await alice.get(f"{PATH}/{one['id']}")).json() == one
        tlog = await alice.get(f"{PATH}/{one['id']}/tlog")
        assert len(tlog.content) == one["size_bytes"]
        part = await alice.get(f"{PATH}/{one['id']}/tlog", headers={"Range": "bytes=8-99"})
        assert (part.status_code, part.content) == (206, tlog.content[8:100])
    assert (await alice.get(f"{PATH}/{listed[0]['id']}/tlog")).content == logs["tlog"]
    assert left_behind(world) == [".json"] * 3 + [".tlog"] * 3
    assert (await alice.delete(f"{PATH}/{listed[0]['id']}")).status_code == 204
    assert_problem(await alice.get(f"{PATH}/{listed[0]['id']}"), 404, "unknown-import")
    assert left_behind(world) == [".json"] * 2 + [".tlog"] * 2
    admin = await world.signed_in(await world.add_user("root", Role.ADMIN))
    actions = [one["action"] for one in (await admin.get("/api/v1/audit")).json()]
    assert (actions.count("flight.imported"), actions.count("flight.import_deleted")) == (3, 1)


async def test_nobody_else_finds_it_but_admins(world: TowerWorld) -> None:
    alice = await world.signed_in(await world.add_user("alice"))
    flight = (await sent(alice, dataflash_log(5))).json()
    bob = await world.signed_in(await world.add_user("bob"))
    olga = await world.signed_in(await world.add_user("olga", Role.OBSERVER))
    admin = await world.signed_in(await world.add_user("root", Role.ADMIN))
    for other in (bob, olga):
        assert (await other.get(PATH)).json() == []
        for ending in ("", "/tlog"):
            assert_problem(await other.get(f"{PATH}/{flight['id']}{ending}"), 404, "unknown-import")
    assert_problem(await bob.delete(f"{PATH}/{flight['id']}"), 404, "unknown-import")
    assert_problem(await sent(olga, dataflash_log(5)), 403, "read-only-account")
    assert_problem(await sent(await world.client(), dataflash_log(5)), 401, "not-signed-in")
    assert [one["id"] for one in (await admin.get(PATH)).json()] == [flight["id"]]
    assert (await admin.delete(f"{PATH}/{flight['id']}")).status_code == 204
    assert (await alice.get(PATH)).json() == []


async def test_bad_files_are_refused_with_words_and_leave_nothing(world: TowerWorld) -> None:
    alice = await world.signed_in(await world.add_user("alice"))
    bad = {b"": "no flight file", b"GIF89a" * 99: "no flight file", b"\xa3\x95\x80" + bytes(300): "nothing in this log"}
    for log, words in bad.items():
        answer = await sent(alice, log)
        assert_problem(answer, 422, "bad-flight-file")
        assert words in answer.json()["detail"]
    large = await sent(alice, bytes(1_000_001))
    assert_problem(large, 422, "bad-flight-file")
    assert large.json()["detail"] == "the file is larger than 1 MB"

    async def pieces() -> AsyncIterator[bytes]:
        yield b"chunked"

    no_length = await alice.post(PATH, content=pieces(), headers=RAW)
    assert_problem(no_length, 422, "bad-flight-file")
    assert left_behind(world) == []
    assert (await sent(alice, dataflash_log(5))).status_code == 201


async def test_each_person_has_room_of_their_own(world: TowerWorld) -> None:
    alice = await world.signed_in(await world.add_user("alice"))
    shares = world.tower.hub.state.shares
    shares.apply({ShareName.IMPORTS: 1})
    assert (await sent(alice, dataflash_log(5))).status_code == 201
    assert_problem(await sent(alice, dataflash_log(5)), 409, "imports-full")
    bob = await world.signed_in(await world.add_user("bob"))
    assert (await sent(bob, ulog_log(5))).status_code == 201
    shares.apply({})
    world.tower.services.of(FlightImports)._budget_bytes = 20_000
    answer = await sent(alice, telemetry_log(BEGAN_S, 20.0, 10))
    assert_problem(answer, 409, "imports-full")
    assert len(left_behind(world)) == 4


async def test_one_person_imports_one_file_at_a_time(world: TowerWorld) -> None:
    alice = await world.signed_in(await world.add_user("alice"))
    begun, go_on = asyncio.Event(), asyncio.Event()

    async def slowly(source: Path, target: Path, uploaded_us: int) -> Converted:
        begun.set()
        await go_on.wait()
        return await run_converter(source, target, uploaded_us)

    world.tower.services.of(FlightImports)._convert = slowly
    first = asyncio.create_task(sent(alice, dataflash_log(5)))
    await begun.wait()
    second = await sent(alice, dataflash_log(5))
    assert_problem(second, 409, "imports-full")
    go_on.set()
    assert (await first).status_code == 201


async def test_the_start_removes_what_never_became_whole_and_what_deleted_people_left(world: TowerWorld) -> None:
    user = await world.add_user("alice")
    alice = await world.signed_in(user)
    flight = (await sent(alice, dataflash_log(5))).json()
    root = world.settings.files / "flight-imports"
    (root / f"user-{user.id}" / "x.upload.part").write_bytes(b"half")
    (root / "user-99999").mkdir()
    (root / "user-99999" / "x.tlog").write_bytes(b"of somebody who was deleted")
    await world.tower.services.of(FlightImports).sweep(world.database)
    assert [path.name for path in root.iterdir()] == [f"user-{user.id}"]
    assert left_behind(world) == [".json", ".tlog"]
    assert (await alice.get(PATH)).json()[0]["id"] == flight["id"]
