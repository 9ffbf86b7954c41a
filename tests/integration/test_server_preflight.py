"""The preflight checklist over REST: own lines, who signs, and what keeps the signature."""

import json
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from flying_scene import Scene
from tower_world import assert_problem, start_tower

TIGHT, LATCHED = "Propellers tight", "Battery latched"


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        await scene.begin()
        scene.agent.state()
        yield scene


async def test_own_lines_are_confirmed_and_signed_and_go_into_the_flight(scene: Scene) -> None:
    path = f"{scene.path}/preflight"
    kind = (await scene.holder.get(path)).json()["kind"]
    assert (await scene.admin.put(f"/api/v1/checklists/{kind}", json={"lines": [TIGHT]})).status_code == 200
    assert (await scene.holder.put(f"{path}/lines", json={"lines": [LATCHED]})).status_code == 200
    seen = (await scene.watcher.get(path)).json()
    assert seen["own"] == [{"text": TIGHT, "of": "kind"}, {"text": LATCHED, "of": "drone"}]
    assert (seen["signed"], seen["may_sign"]) == (None, False)
    assert {line["key"]: line["state"] for line in seen["lines"]}["home"] == "good"

    missing = await scene.holder.post(f"{path}/sign", json={"checked": [TIGHT]})
    assert "checklist of kestrel first: 1 item left" in assert_problem(missing, 409, "preflight-incomplete")["detail"]
    assert_problem(await scene.watcher.post(f"{path}/sign", json={"checked": [TIGHT, LATCHED]}), 403, "signs-for-pilot")
    body = {"checked": [TIGHT, LATCHED], "weather": "wind 5 m/s"}
    signed = (await scene.holder.post(f"{path}/sign", json=body)).json()["signed"]
    assert (signed["by"]["name"], signed["weather"]) == ("alice", "wind 5 m/s")

    scene.agent.state(armed=True, airborne=True)
    scene.world.clock.advance(3 * 3600)
    assert (await scene.watcher.get(path)).json()["signed"] == signed  # of the flight that is going on
    flights = scene.world.tower.hub.flights
    flights.tick(1e9)
    scene.agent.state()
    assert (await scene.watcher.get(path)).json()["signed"] is None
    flights.end_all("the test is over", 1e9)
    (index,) = await _indexes(scene)
    entry = next(one for one in index if one["kind"] == "preflight")
    assert (entry["by"]["name"], entry["weather"]) == ("alice", "wind 5 m/s")
    assert [TIGHT, "confirmed"] in entry["lines"]
    audit = (await scene.admin.get("/api/v1/audit?action=preflight.signed")).json()
    assert [TIGHT, "confirmed"] in audit[0]["detail"]["lines"]


async def _indexes(scene: Scene) -> list[list[dict[str, object]]]:
    flights = scene.world.tower.flights
    assert flights.writer.stop()
    files = sorted(flights.files.root.rglob("*.jsonl"))
    return [[json.loads(line) for line in file.read_text().splitlines()] for file in files]


async def test_lines_are_for_owners_and_admins(scene: Scene) -> None:
    path = f"{scene.path}/preflight/lines"
    carol = await scene.lend_to_carol()
    assert_problem(await carol.put(path, json={"lines": [TIGHT]}), 403, "not-your-checklist")
    assert_problem(await carol.put("/api/v1/checklists/unheard", json={"lines": [TIGHT]}), 403, "admins-only")
    assert_problem(await scene.admin.put("/api/v1/checklists/unheard", json={"lines": []}), 404, "no-such-kind")
    for bad in ([""], ["x" * 161], ["line"] * 41, ["a\u0000b"]):
        assert (await scene.admin.put(path, json={"lines": bad})).status_code == 422
    assert (await scene.admin.put(path, json={"lines": [TIGHT]})).status_code == 200
    assert (await scene.admin.put(path, json={"lines": []})).json() == {"lines": []}
