"""An observer account: it sees the drones assigned to it, and cannot get the controls in any way."""

import json
from pathlib import Path

import httpx
import pytest
from control_world import ObedientAgent, ask, audit
from tower_world import Person, TowerWorld, assert_problem, start_tower
from websockets.asyncio.client import connect
from websockets.typing import Subprotocol

from server.kernel.people import Role


@pytest.fixture
async def world(tmp_path: Path):
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def olga(world: TowerWorld) -> Person:
    return await world.add_user("Olga", Role.OBSERVER)


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


async def test_an_observer_sees_what_it_is_given_and_nothing_else(world: TowerWorld, olga: Person) -> None:
    hawk = await world.add_drone("hawk", olga)
    await world.add_drone("kite")
    watching = await world.signed_in(olga)
    (seen,) = (await watching.get("/api/v1/drones")).json()
    assert (seen["id"], seen["relation"]) == (hawk.id, "observer")
    headers = world.cookie_header(watching) | {"Origin": world.base_url}
    protocols = [Subprotocol("tower.v1")]
    async with connect(world.live_url, additional_headers=headers, subprotocols=protocols, proxy=None) as socket:
        welcome = json.loads(await socket.recv())
        assert welcome["user"]["role"] == "observer"
        assert [drone["id"] for drone in welcome["drones"]] == [hawk.id]


async def test_a_team_gives_an_observer_its_drones_whatever_they_are_in_it(
    world: TowerWorld, olga: Person, root: httpx.AsyncClient
) -> None:
    owner = await world.add_user("Anna")
    hawk = await world.add_drone("hawk", owner)
    team = (await root.post("/api/v1/teams", json={"name": "field"})).json()["id"]
    for person in (owner, olga):
        await root.put(f"/api/v1/teams/{team}/members/{person.id}", json={"role": "admin"})
    assert (await root.put(f"/api/v1/teams/{team}/drones/{hawk.id}")).is_success
    watching = await world.signed_in(olga)
    (seen,) = (await watching.get("/api/v1/drones")).json()
    assert seen["relation"] == "observer"
    assert_problem(await watching.patch(f"/api/v1/teams/{team}", json={"name": "x"}), 403, "read-only-account")
    left = await watching.delete(f"/api/v1/teams/{team}/members/{owner.id}")
    assert_problem(left, 403, "team-admins-only")
    assert (await watching.delete(f"/api/v1/teams/{team}/members/{olga.id}")).is_success


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("POST", "control/acquire", {}),
        ("POST", "control/take", {}),
        ("POST", "control/assist", {}),
        ("POST", "control/accept", {"sticks_centred": True}),
        ("POST", "control/stay", {}),
        ("POST", "commands", {"command": "land"}),
        ("POST", "recordings", {}),
        ("PUT", "mission", {"items": []}),
        ("POST", "rehearsal", {"what": "tower"}),
    ],
)
async def test_an_observer_does_nothing_at_a_drone(
    world: TowerWorld, olga: Person, method: str, path: str, body: dict[str, object]
) -> None:
    hawk = await world.add_drone("hawk", olga)
    agent = ObedientAgent(world.tower.hub, hawk.id)
    agent.state()
    watching = await world.signed_in(olga)
    answer = await watching.request(method, f"/api/v1/drones/{hawk.id}/{path}", json=body)
    assert_problem(answer, 403, "read-only-account")
    assert agent.holds == []


@pytest.mark.parametrize("path", ["recordings", "logs"])
async def test_an_observer_reads_nothing_that_was_kept(world: TowerWorld, olga: Person, path: str) -> None:
    hawk = await world.add_drone("hawk", olga)
    watching = await world.signed_in(olga)
    assert_problem(await watching.get(f"/api/v1/drones/{hawk.id}/{path}"), 403, "only-watches")
    assert (await watching.get(f"/api/v1/drones/{hawk.id}/video")).status_code == 200  # live data


async def test_nobody_makes_a_pilot_of_an_observer(world: TowerWorld, olga: Person, root: httpx.AsyncClient) -> None:
    hawk = await world.add_drone("hawk")
    lent = await root.put(
        f"/api/v1/drones/{hawk.id}/loans/{olga.id}", json={"until": "2999-01-01T00:00:00Z", "may_arm": True}
    )
    assert not lent.is_success, lent.text
    watching = await world.signed_in(olga)
    refused = await watching.post("/api/v1/tokens", json={"name": "x", "scopes": ["watch", "fly"]})
    assert_problem(refused, 422, "invalid-request")
    made = (await watching.post("/api/v1/tokens", json={"name": "x", "scopes": ["watch"]})).json()
    with_token = await world.client(headers={"Authorization": f"Bearer {made['secret']}"})
    assert (await with_token.get("/api/v1/drones")).status_code == 200


async def test_a_pilot_who_becomes_an_observer_loses_the_controls_and_the_drone_holds(
    world: TowerWorld, root: httpx.AsyncClient
) -> None:
    anna = await world.add_user("Anna")
    hawk = await world.add_drone("hawk", anna)
    agent = ObedientAgent(world.tower.hub, hawk.id)
    pilot = await world.signed_in(anna)
    token = (await pilot.post("/api/v1/tokens", json={"name": "x", "scopes": ["watch", "fly"]})).json()["secret"]
    held = (await ask(pilot, hawk.id, "acquire")).json()
    assert (await root.patch(f"/api/v1/users/{anna.id}", json={"role": "observer"})).is_success

    after = (await root.get(f"/api/v1/drones/{hawk.id}")).json()
    assert (after["holder"], after["epoch"]) == (None, held["epoch"] + 1)
    assert [order.epoch for order in agent.decided_holds] == [after["epoch"]]
    assert await audit(root, "control.revoke")
    assert_problem(await ask(pilot, hawk.id, "acquire"), 403, "read-only-account")
    with_token = await world.client(headers={"Authorization": f"Bearer {token}"})
    assert_problem(await ask(with_token, hawk.id, "acquire"), 403, "read-only-account")


async def test_the_controls_are_not_given_back_to_an_observer(world: TowerWorld, root: httpx.AsyncClient) -> None:
    anna = await world.add_user("Anna")
    hawk = await world.add_drone("hawk", anna)
    pilot = await world.signed_in(anna)
    assert (await ask(pilot, hawk.id, "acquire")).is_success
    assert (await ask(root, hawk.id, "take")).is_success
    assert (await root.patch(f"/api/v1/users/{anna.id}", json={"role": "observer"})).is_success
    assert_problem(await ask(root, hawk.id, "give"), 409, "nothing-to-give")  # an observer is not entitled to a return
    assert (await root.get(f"/api/v1/drones/{hawk.id}")).json()["taken_from"] is None
