"""Parameters over REST: the whole table with its hash, changes, and values that differ from the request."""

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from control_world import live, until
from flying_scene import Scene
from tower_world import assert_problem, start_tower

from wire.parameter_metadata import (
    PARAMETER_METADATA,
    MetadataDocument,
    MetadataEntry,
    MetadataKnown,
    MetadataPiece,
    MetadataWanted,
    encode_metadata,
    metadata_hash,
    pack_text,
)
from wire.parameters import table_hash
from wire.transactions import ParameterCache, ParametersReadWork, ParametersWriteWork


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        await scene.begin()
        yield scene


async def test_the_table_is_read_once_and_answered_with_its_hash(scene: Scene) -> None:
    path = f"{scene.path}/parameters"
    assert_problem(await scene.watcher.get(path), 409, "parameters-unknown")
    scene.agent.announce(ParameterCache(hash=None, count=1, total=2))
    half = assert_problem(await scene.watcher.get(path), 409, "parameters-unknown")
    assert (half["count"], half["total"]) == (1, 2)
    assert (await scene.watcher.get(scene.path)).json()["parameters"] == {"hash": None, "count": 1, "total": 2}
    scene.agent.report_parameters()
    parameters = scene.world.tower.hub.state.drones.get(scene.drone.id).onboard.parameters
    await until("the table", lambda: not parameters.lacks_table)
    answer = await scene.watcher.get(path)
    assert answer.status_code == 200, answer.text
    table = answer.json()
    assert table["values"] == [
        {"name": "ARMING_CHECK", "value": 1.0, "kind": 6},
        {"name": "RTL_ALT", "value": 1500.0, "kind": 9},
    ]
    assert answer.headers["ETag"] == f'"{table["hash"]}"' == f'"{table_hash(scene.agent.table)}"'
    for accepted, coding in (("gzip, br", "gzip"), ("identity", None), ("gzip;q=0", None)):
        coded = await scene.watcher.get(path, headers={"Accept-Encoding": accepted})
        assert (coded.json(), coded.headers.get("Content-Encoding")) == (table, coding)
        assert coded.headers["Vary"] == "Accept-Encoding"
    for known, status in ((answer.headers["ETag"], 304), (f'"x", W/{answer.headers["ETag"]}', 304), ('"x"', 200)):
        assert (await scene.watcher.get(path, headers={"If-None-Match": known})).status_code == status
    assert [type(one.work) for one in scene.agent.asked] == [ParametersReadWork]


async def test_values_are_written_in_their_order_and_what_was_not_taken_is_told_by_name(scene: Scene) -> None:
    async with live(scene.world, scene.watcher) as watching:
        answer = await scene.holder.patch(
            f"{scene.path}/parameters", json={"values": {"RTL_ALT": 3000, "ARMING_CHECK": 9001, "NO_SUCH": 1}}
        )
        operation = answer.json()
        assert (operation["work"], operation["state"], operation["refused"]) == ("parameters_write", "failed", 2)
        assert [(one["name"], one["asked"], one["has"]) for one in operation["refusals"]] == [
            ("ARMING_CHECK", 9001.0, 1.0),
            ("NO_SUCH", 1.0, None),
        ]
        reported = await watching.event("parameters", hash=table_hash(scene.agent.table))
        assert reported["count"] == 2
    written = next(one.work for one in scene.agent.asked if isinstance(one.work, ParametersWriteWork))
    assert written.values == (("RTL_ALT", 3000.0), ("ARMING_CHECK", 9001.0), ("NO_SUCH", 1.0))
    parameters = scene.world.tower.hub.state.drones.get(scene.drone.id).onboard.parameters
    await until("the new table", lambda: not parameters.lacks_table)
    assert (await scene.holder.get(f"{scene.path}/parameters")).json()["values"][1]["value"] == 3000.0


async def test_who_only_watches_has_them_read_anew_but_writes_nothing_and_neither_does_a_borrower(scene: Scene) -> None:
    again = await scene.watcher.post(f"{scene.path}/parameters/read")
    assert again.json()["state"] == "done"
    assert scene.agent.asked[0].work == ParametersReadWork(again=True)
    values = {"values": {"RTL_ALT": 3000}}
    assert_problem(await scene.watcher.patch(f"{scene.path}/parameters", json=values), 409, "not-in-control")
    carol = await scene.lend_to_carol()
    assert_problem(await carol.patch(f"{scene.path}/parameters", json=values), 409, "loan")
    assert scene.agent.table[1].value == 1500.0


@pytest.mark.parametrize(
    "values", [{}, {"RTL_ALT": "3000"}, {"NO GOOD": 1}, {"A" * 17: 1}, [["RTL_ALT", 1]], {"RTL_ALT": None}]
)
async def test_what_are_no_values_is_refused(scene: Scene, values: object) -> None:
    answer = await scene.holder.patch(f"{scene.path}/parameters", json={"values": values})
    assert_problem(answer, 422, "invalid-request")
    assert scene.agent.asked == []


DOCUMENT = MetadataDocument(parameters=(MetadataEntry(name="RTL_ALT", units="cm", min=30.0, max=8000.0),))


def report_metadata(scene: Scene, packed: bytes, *, hash_: str = "") -> None:
    """Acts as an agent: reports the hash, and the requested pieces."""
    hash_ = hash_ or metadata_hash(packed)
    scene.agent.announce(MetadataKnown(hash=hash_, size_bytes=len(packed)))
    if MetadataWanted(hash=hash_) in scene.agent.posted:
        for at in range(0, len(packed), 50):
            scene.agent.announce(MetadataPiece(hash=hash_, offset=at, data=packed[at : at + 50]))


def knows_of_metadata(scene: Scene) -> None:
    scene.agent.link.takes |= {PARAMETER_METADATA}


async def test_what_the_vehicle_says_of_them_is_answered_with_its_hash(scene: Scene) -> None:
    knows_of_metadata(scene)
    path, packed = f"{scene.path}/parameters/metadata", pack_text(encode_metadata(DOCUMENT))
    assert "has reported none" in assert_problem(await scene.watcher.get(path), 404, "no-metadata")["detail"]
    scene.agent.announce(MetadataKnown(hash=None, words="The vehicle offers none."))
    assert "offers none" in assert_problem(await scene.watcher.get(path), 404, "no-metadata")["detail"]
    scene.agent.announce(MetadataKnown(hash=metadata_hash(packed), size_bytes=len(packed)))
    assert "on its way" in assert_problem(await scene.watcher.get(path), 404, "no-metadata")["detail"]
    report_metadata(scene, packed)
    answer = await scene.watcher.get(path)
    assert answer.status_code == 200, answer.text
    assert answer.json() == {
        "version": 1,
        "parameters": [{"name": "RTL_ALT", "units": "cm", "min": 30.0, "max": 8000.0}],
    }
    assert answer.headers["ETag"] == f'"{metadata_hash(packed)}"'
    for accepted, coding in (("gzip, br", "gzip"), ("identity", None), ("gzip;q=0", None)):
        coded = await scene.watcher.get(path, headers={"Accept-Encoding": accepted})
        assert (coded.json(), coded.headers.get("Content-Encoding")) == (answer.json(), coding)
        assert coded.headers["Vary"] == "Accept-Encoding"
    for known, status in ((answer.headers["ETag"], 304), ('"x"', 200)):
        assert (await scene.watcher.get(path, headers={"If-None-Match": known})).status_code == status
    wanted = len([one for one in scene.agent.posted if isinstance(one, MetadataWanted)])
    report_metadata(scene, packed)
    assert len([one for one in scene.agent.posted if isinstance(one, MetadataWanted)]) == wanted, "the tower has it"


@pytest.mark.parametrize("junk", [b"no gzip", pack_text(b'{"version":1,"parameters":7}')], ids=["bytes", "json"])
async def test_what_is_no_metadata_is_given_to_nobody(scene: Scene, junk: bytes) -> None:
    knows_of_metadata(scene)
    report_metadata(scene, junk)
    for _ in range(2):
        problem = assert_problem(await scene.watcher.get(f"{scene.path}/parameters/metadata"), 404, "no-metadata")
        assert "not parameter metadata" in problem["detail"]
    good = pack_text(encode_metadata(DOCUMENT))
    report_metadata(scene, good)
    assert (await scene.watcher.get(f"{scene.path}/parameters/metadata")).status_code == 200


async def test_an_older_agent_is_not_asked_for_what_it_does_not_know(scene: Scene) -> None:
    """An unknown message type would end its channel. If it reports metadata anyway, the tower ignores it."""
    report_metadata(scene, pack_text(encode_metadata(DOCUMENT)))
    assert not [one for one in scene.agent.posted if isinstance(one, MetadataWanted)]
    assert_problem(await scene.watcher.get(f"{scene.path}/parameters/metadata"), 404, "no-metadata")
