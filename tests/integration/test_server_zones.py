"""Zones through the API and the database: who draws them, who sees them, the audit trail, a plan that is refused."""

import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from flying_scene import Scene
from tower_world import start_tower

from server.airspace.store import zones
from server.airspace.store.follow import ZoneFollower
from server.kernel.people import Role

AREA = [[47.002, 7.999], [47.003, 7.999], [47.003, 8.001], [47.002, 8.001]]
"""Some 220 m north of home."""
ZONE: dict[str, Any] = {"name": "Hospital", "kind": "no-fly", "points": AREA, "reason": "helicopter"}


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        await scene.begin()
        yield scene


async def test_an_admin_draws_changes_and_deletes_a_zone(scene: Scene) -> None:
    admin, holder = scene.admin, scene.holder
    assert (await holder.post("/api/v1/zones", json=ZONE)).status_code == 403
    made = await admin.post("/api/v1/zones", json=ZONE)
    assert made.status_code == 201, made.text
    zone = made.json()
    assert [one["name"] for one in (await holder.get("/api/v1/zones")).json()] == ["Hospital"]
    assert scene.world.tower.hub.state.drones[scene.drone.id].zones, "it counts when the answer arrives"

    path = f"/api/v1/zones/{zone['id']}"
    changed = ZONE | {"name": "Clinic", "ceiling_m": 80.0, "version": 1}
    assert (await admin.put(path, json=changed)).json()["version"] == 2
    assert (await admin.put(path, json=changed)).status_code == 412
    assert (await holder.delete(path)).status_code == 403
    assert (await admin.delete(path)).status_code == 204
    assert (await admin.delete(path)).status_code == 404
    assert not scene.world.tower.hub.state.drones[scene.drone.id].zones
    trail = (await admin.get("/api/v1/audit?limit=200")).json()
    about = {one["action"]: one["detail"] for one in trail if one["action"].startswith("zone.")}
    assert about["zone.created"]["zone"] == "Hospital"
    assert about["zone.changed"]["before"] == {"zone": "Hospital", "ceiling_m": None}
    assert about["zone.deleted"]["points"] == 4


async def test_what_makes_no_zone_is_refused_with_its_field(scene: Scene) -> None:
    for wrong, field in (
        (ZONE | {"kind": "height-limit"}, "ceiling_m"),
        (ZONE | {"points": [AREA[0], AREA[2], AREA[1], AREA[3]]}, "points"),
        (ZONE | {"points": AREA[:2]}, "points"),
        (ZONE | {"name": " "}, "name"),
        (ZONE | {"valid_from": "2030-01-02T00:00:00Z", "valid_until": "2030-01-01T00:00:00Z"}, "valid_until"),
    ):
        answer = await scene.admin.post("/api/v1/zones", json=wrong)
        assert answer.status_code == 422, answer.text
        assert answer.json()["errors"][0]["field"] == field


async def test_a_team_draws_its_own_zones_and_others_do_not_know_them(scene: Scene) -> None:
    world, holder = scene.world, scene.holder
    team = (await holder.post("/api/v1/teams", json={"name": "Coast"})).json()
    made = await holder.post("/api/v1/zones", json=ZONE | {"team_id": team["id"]})
    assert made.status_code == 201, made.text
    dora = await world.signed_in(await world.add_user("dora", Role.OPERATOR))
    assert (await dora.get("/api/v1/zones")).json() == []
    path = f"/api/v1/zones/{made.json()['id']}"
    assert (await dora.delete(path)).status_code == 404
    assert (await dora.post("/api/v1/zones", json=ZONE | {"team_id": team["id"]})).status_code == 404
    assert not world.tower.hub.state.drones[scene.drone.id].zones, "the drone is in no team"
    assert (await holder.put(f"/api/v1/teams/{team['id']}/drones/{scene.drone.id}")).status_code == 200
    world.tower.hub.zones.tick(1e9)
    assert world.tower.hub.state.drones[scene.drone.id].zones
    assert (await holder.delete(f"/api/v1/teams/{team['id']}")).status_code == 204
    await world.tower.services.of(ZoneFollower).refresh()
    assert (await scene.admin.get("/api/v1/zones")).json() == []


async def test_no_team_takes_the_room_of_others_or_of_the_tower(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    for share, limit in (("zones", 2), ("zones-of-teams", 4)):
        assert (await scene.admin.put(f"/api/v1/shares/{share}", json={"limit": limit})).status_code == 200
    monkeypatch.setattr(zones, "MAX_ZONES", 6)

    async def drawn(client: httpx.AsyncClient, team_id: int | None) -> tuple[int, str]:
        answer = await client.post("/api/v1/zones", json=ZONE | {"team_id": team_id})
        return answer.status_code, answer.json().get("detail", "")

    first, second = [(await scene.holder.post("/api/v1/teams", json={"name": one})).json()["id"] for one in ("A", "B")]
    by_admin = [(await scene.admin.post("/api/v1/teams", json={"name": one})).json()["id"] for one in ("C", "D")]
    assert [(await drawn(scene.holder, team))[0] for team in (first, second)] == [201, 201]
    status, why = await drawn(scene.holder, second)
    assert (status, "one person has made" in why) == (409, True)
    assert [(await drawn(scene.admin, team))[0] for team in by_admin] == [201, 201]
    status, why = await drawn(scene.admin, by_admin[0])
    assert (status, "all teams together" in why) == (409, True)
    assert [(await drawn(scene.admin, None))[0] for _ in range(3)] == [201, 201, 409]


async def test_a_plan_into_a_zone_is_refused_with_words(scene: Scene) -> None:
    await scene.admin.post("/api/v1/zones", json=ZONE)
    items = [[22, 3, [0, 0, 0, None], 0, 0, 20, 1], [16, 3, [0, 0, 0, None], 470040000, 80000000, 20, 1]]
    answer = await scene.holder.put(f"{scene.path}/mission", json={"items": items})
    assert answer.status_code == 409, answer.text
    problem = answer.json()
    assert (problem["type"], problem["item"]) == ("/problems/zone", 1)
    assert problem["detail"] == ("item 2: the way of kestrel there leads into the no-fly zone Hospital (helicopter)")


async def test_a_file_gives_shapes_and_stores_nothing(scene: Scene) -> None:
    ring = [[lon, lat] for lat, lon in AREA]
    text = json.dumps({"type": "Polygon", "coordinates": [[*ring, ring[0]]]})
    found = await scene.admin.post("/api/v1/zones/shapes", json={"text": text})
    assert found.status_code == 200, found.text
    assert found.json()["shapes"] == [{"name": "Shape 1", "points": AREA, "is_line": False, "reason": ""}]
    assert (await scene.admin.post("/api/v1/zones/shapes", json={"text": "<!DOCTYPE a><a/>"})).status_code == 422
    assert (await scene.admin.get("/api/v1/zones")).json() == []
