"""Muting, limiting and quarantining a drone: who may, what is said before, and what its agent is told."""

from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest
from control_world import ObedientAgent, audit, until
from identity_world import signed_in
from team_world import ADMIN, OBSERVER, OPERATOR, Team
from tower_world import TowerWorld, assert_problem, start_tower

from control_tower import Refused, Tower
from onboard_agent.sockets.control_channel import CredentialRefused
from server.kernel.people import Role
from server.link.core.restraint import QUARANTINED_WORDS
from wire.ids import DroneId


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


@pytest.fixture
async def team(world: TowerWorld) -> Team:
    return await Team(world, "kites").set_up()


def path(drone_id: int) -> str:
    return f"/api/v1/drones/{drone_id}/restraint"


async def test_a_quarantined_agent_is_refused_in_words_and_its_key_stays(
    world: TowerWorld, root: httpx.AsyncClient
) -> None:
    hawk = await world.add_drone("hawk")
    async with signed_in(world, hawk.identity) as opened:
        done = await root.put(path(hawk.id), json={"measure": "quarantined", "reason": "floods", "confirmed": True})
        restraint = done.json()["restraint"]
        assert (restraint["measure"], restraint["reason"], restraint["by"]) == ("quarantined", "floods", "Root")
        await opened.connection.wait_closed()
        assert opened.connection.close_reason == QUARANTINED_WORDS
    with pytest.raises(CredentialRefused, match="an admin has quarantined this drone"):
        async with signed_in(world, hawk.identity):
            pass
    drone = world.tower.hub.state.drones[DroneId(hawk.id)]
    assert drone.record.public_key == hawk.key.public
    lifted = await root.delete(path(hawk.id))
    assert lifted.json()["restraint"] is None
    async with signed_in(world, hawk.identity):
        assert drone.link is not None
    trail = await audit(root, "drone.restrain")
    assert [one["action"] for one in trail] == ["drone.restraint_lifted", "drone.restrained"]
    assert trail[1]["detail"] == {"drone": "hawk", "measure": "quarantined", "before": "", "reason": "floods"}


async def test_in_the_air_it_must_be_confirmed_and_says_what_follows(
    world: TowerWorld, root: httpx.AsyncClient
) -> None:
    hawk = await world.add_drone("hawk")
    agent = ObedientAgent(world.tower.hub, hawk.id)
    agent.state(armed=True, airborne=True)
    said = (await root.get(path(hawk.id))).json()
    assert [(one["measure"], one["needs_confirmation"]) for one in said["measures"]] == [
        ("muted", False),
        ("limited", False),
        ("quarantined", True),
    ]
    assert all("hawk" in one["effect"] for one in said["measures"])
    refused = assert_problem(await root.put(path(hawk.id), json={"measure": "quarantined"}), 409, "loses-its-link")
    assert "returns after 30 s" in refused["detail"]
    drone = world.tower.hub.state.drones[DroneId(hawk.id)]
    assert drone.link is agent.link
    assert (await root.put(path(hawk.id), json={"measure": "limited"})).status_code == 200
    assert (drone.link, drone.is_limited) == (agent.link, True)
    assert (await root.put(path(hawk.id), json={"measure": "quarantined", "confirmed": True})).status_code == 200
    assert drone.link is None


async def test_admins_of_its_team_may_and_nobody_below(world: TowerWorld, root: httpx.AsyncClient, team: Team) -> None:
    where = path(team.drone_id)
    for role in (OPERATOR, OBSERVER):
        for answer in (
            await team.clients[role].get(where),
            await team.clients[role].put(where, json={"measure": "muted"}),
            await team.clients[role].delete(where),
        ):
            assert_problem(answer, 403, "admins-only")
    stranger = await world.signed_in(await world.add_user("Stranger"))
    assert_problem(await stranger.put(where, json={"measure": "muted"}), 404, "unknown-drone")
    assert (await team.clients[ADMIN].put(where, json={"measure": "muted"})).json()["restraint"]["measure"] == "muted"
    assert (await team.clients[ADMIN].delete(where)).json()["restraint"] is None
    # What an admin of the tower did is not theirs to lift or to soften.
    await root.put(where, json={"measure": "quarantined"})
    assert_problem(await team.clients[ADMIN].delete(where), 403, "admins-only")
    assert_problem(await team.clients[ADMIN].put(where, json={"measure": "muted"}), 403, "admins-only")
    seen = (await team.clients[OBSERVER].get(f"/api/v1/drones/{team.drone_id}")).json()
    assert seen["restraint"]["measure"] == "quarantined"
    assert (await root.delete(where)).json()["restraint"] is None


async def test_it_outlives_a_restart_and_goes_with_the_drone(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
        hawk, kite = await world.add_drone("hawk"), await world.add_drone("kite")
        for drone in (hawk, kite):
            await root.put(path(drone.id), json={"measure": "quarantined"})
        assert (await root.delete(f"/api/v1/drones/{kite.id}")).status_code == 204
    async with start_tower(tmp_path) as world:
        assert world.tower.hub.state.drones[DroneId(hawk.id)].is_quarantined
        with pytest.raises(CredentialRefused):
            async with signed_in(world, hawk.identity):
                pass


async def test_a_program_does_the_same(world: TowerWorld, root: httpx.AsyncClient) -> None:
    hawk = await world.add_drone("hawk")
    made = await root.post("/api/v1/tokens", json={"name": "guard", "scopes": ["watch", "fly", "admin"]})
    async with Tower(world.base_url, made.json()["secret"]) as tower:
        drone = tower.drone("hawk")
        assert "hawk" in (await drone.effects())["quarantined"]
        await drone.restrain("limited", "floods")
        await until("the limit", lambda: drone.state.restraint == "limited")
        await drone.unrestrain()
        await until("its end", lambda: drone.state.restraint == "")
        ObedientAgent(world.tower.hub, hawk.id).state(armed=True, airborne=True)
        with pytest.raises(Refused, match="Confirm it") as refused:
            await drone.restrain("quarantined")
        assert refused.value.code == "loses-its-link"


async def test_what_is_no_measure(world: TowerWorld, root: httpx.AsyncClient) -> None:
    hawk = await world.add_drone("hawk")
    for body in ({"measure": "shot"}, {"measure": "muted", "reason": "x" * 201}, {}):
        assert_problem(await root.put(path(hawk.id), json=body), 422, "invalid-request")
    assert_problem(await root.put(path(999), json={"measure": "muted"}), 404, "unknown-drone")
