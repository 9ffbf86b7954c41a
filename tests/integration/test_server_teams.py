"""Teams on a running tower: roles, membership changes, invitations and drones."""

from collections.abc import AsyncIterator
from datetime import timedelta
from pathlib import Path

import httpx
import pytest
from control_world import ObedientAgent, ask, audit, live
from team_world import ADMIN, OBSERVER, OPERATOR, Team
from tower_world import TowerWorld, assert_problem, start_tower

from server.audit.store.action import AuditAction
from server.audit.store.trail import COMMAND_LINE as BY_COMMAND_LINE
from server.kernel.people import Role
from server.teams.store import teams
from server.teams.store.teams import COMMAND_LINE
from wire.dialect import build, mavlink
from wire.ids import DroneId
from wire.tagged import tag


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def red(world: TowerWorld) -> Team:
    return await Team(world, "Rowan").set_up()


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


async def test_each_role_may_what_the_table_says(world: TowerWorld, red: Team, root: httpx.AsyncClient) -> None:
    agent = ObedientAgent(world.tower.hub, red.drone_id)
    agent.state(armed=True, airborne=True)
    drone = f"/api/v1/drones/{red.drone_id}"
    for role, relation in ((OBSERVER, "observer"), (OPERATOR, "team-operator"), (ADMIN, "team-admin")):
        view = (await red.clients[role].get(drone)).json()
        assert (view["relation"], view["team"]["name"]) == (relation, "Rowan-team")
    observer, operator, chief = (red.clients[role] for role in (OBSERVER, OPERATOR, ADMIN))

    # An observer can only watch.
    assert (await observer.get(f"{drone}/video")).status_code == 200
    assert_problem(await ask(observer, red.drone_id, "acquire"), 403, "not-an-owner")
    assert_problem(await ask(observer, red.drone_id, "take"), 403, "admins-only")
    assert_problem(await ask(observer, red.drone_id, "stay"), 403, "not-an-owner")
    assert_problem(await observer.post(f"{drone}/parameters/read"), 403, "only-watches")
    assert_problem(await observer.get(f"{drone}/mission?fresh=true"), 403, "only-watches")
    assert_problem(await observer.get(f"{drone}/recordings"), 403, "only-watches")
    assert_problem(await observer.get(f"{drone}/logs"), 403, "only-watches")
    assert_problem(await observer.post(f"{drone}/commands", json={"command": "land"}), 409, "not-in-control")
    async with live(world, observer) as screen:
        request = mavlink.MAVLink_param_request_list_message(1, 1)
        frame = build(request, system_id=255, component_id=190, sequence=0)
        await screen.socket.send(tag(DroneId(red.drone_id), frame))
        await screen.event("notice", code="not-in-control")
    assert world.tower.hub.state.traffic.frames_to_agents == 0

    # An operator flies. The team's admin takes from them, gives back and assists, and each TAKE holds.
    held = (await ask(operator, red.drone_id, "acquire")).json()
    assert held["holder"]["name"] == "Rowan-operator"
    assert_problem(await ask(operator, red.drone_id, "take"), 403, "admins-only")
    assert (await ask(chief, red.drone_id, "assist")).json()["assistant"]["name"] == "Rowan-admin"
    taken = (await ask(chief, red.drone_id, "take")).json()
    assert (taken["holder"]["name"], taken["taken_from"]["name"]) == ("Rowan-admin", "Rowan-operator")
    assert_problem(await ask(operator, red.drone_id, "acquire"), 409, "taken-away")
    assert (await ask(chief, red.drone_id, "give")).status_code == 200
    back = await operator.post(f"{drone}/control/accept", json={"sticks_centred": True})
    assert back.json()["holder"]["name"] == "Rowan-operator"
    assert [order.epoch for order in agent.decided_holds] == [3, 4, 5]

    # A tower admin outranks them: a team admin takes nothing from a tower admin, and the refused TAKE does not lock
    # them out.
    await ask(root, red.drone_id, "take")
    assert_problem(await ask(chief, red.drone_id, "take"), 409, "held-by-admin")
    assert_problem(await ask(chief, red.drone_id, "assist"), 409, "cannot-assist")
    live_drone = world.tower.hub.state.drones.get(DroneId(red.drone_id))
    assert live_drone is not None
    assert not live_drone.fenced
    await ask(root, red.drone_id, "release")

    # For the tower, a team admin is an operator: one drone at a time, also by TAKE.
    other = await world.add_drone("Rowan-second", red.people[ADMIN])
    assert (await ask(chief, other.id, "acquire")).status_code == 200
    await ask(operator, red.drone_id, "acquire")
    assert_problem(await ask(chief, red.drone_id, "take"), 409, "holds-another")
    # And only their team's drones.
    stranger = await world.add_drone("elsewhere", await world.add_user("Otto"))
    assert_problem(await ask(chief, stranger.id, "take"), 404, "unknown-drone")


@pytest.mark.parametrize("way", ["removed", "left", "observer now", "drone taken out", "team deleted", "by the tower"])
async def test_what_a_change_takes_away_is_gone_at_once(world: TowerWorld, red: Team, way: str) -> None:
    agent = ObedientAgent(world.tower.hub, red.drone_id)
    agent.state(armed=True, airborne=True)
    operator, chief = red.clients[OPERATOR], red.clients[ADMIN]
    held = (await ask(operator, red.drone_id, "acquire")).json()
    member = f"{red.path}/members/{red.people[OPERATOR].id}"
    async with live(world, operator) as hers, live(world, chief) as his:
        if way == "removed":
            answer = await chief.delete(member)
        elif way == "left":
            answer = await operator.delete(member)
        elif way == "observer now":
            answer = await red.set_role(OPERATOR, OBSERVER)
        elif way == "drone taken out":
            answer = await chief.delete(f"{red.path}/drones/{red.drone_id}")
        elif way == "team deleted":
            answer = await chief.delete(red.path)
        else:
            async with world.database.writing() as session:
                action = AuditAction(by=BY_COMMAND_LINE, at=world.clock())
                about = {"user_id": red.people[OPERATOR].id, "manager": COMMAND_LINE, "action": action}
                await teams.remove_member(session, red.id, **about)  # type: ignore[arg-type]
            answer = None
        assert answer is None or answer.is_success, answer.text
        if way == "observer now":
            while (await hers.event("drone"))["drone"]["relation"] != "observer":
                pass
        else:
            await hers.event("drone_removed", drone_id=red.drone_id)
        reported = await hers.event("control", drone_id=red.drone_id, event="revoked")
        assert reported["reason"] == "no longer a pilot of its team"
        who = reported["by"]["name"] if reported["by"] else None
        assert who == (None if way in ("left", "by the tower") else "Rowan-admin")
        await his.event("control", drone_id=red.drone_id, event="revoked")
    if way != "by the tower":  # then the response confirms that it is done
        after = (await chief.get(f"/api/v1/drones/{red.drone_id}")).json()
        assert (after["holder"], after["epoch"]) == (None, held["epoch"] + 1)
    assert [order.epoch for order in agent.decided_holds] == [held["epoch"] + 1]
    left = (await operator.get("/api/v1/drones")).json()
    assert [one["relation"] for one in left] == (["observer"] if way == "observer now" else [])


async def test_a_team_admin_who_took_and_is_one_no_more_loses_it(world: TowerWorld, red: Team) -> None:
    second = await world.add_user("Rowan-vice")
    await red.join(second, ADMIN)
    vice = await world.signed_in(second)
    ObedientAgent(world.tower.hub, red.drone_id).state(armed=True, airborne=True)
    await ask(red.clients[OPERATOR], red.drone_id, "acquire")
    await ask(vice, red.drone_id, "take")
    demoted = await red.clients[ADMIN].put(f"{red.path}/members/{second.id}", json={"role": "operator"})
    assert demoted.status_code == 200
    view = (await vice.get(f"/api/v1/drones/{red.drone_id}")).json()
    assert (view["holder"], view["taken_from"], view["relation"]) == (None, None, "team-operator")


async def test_the_last_admin_stays_and_the_tower_repairs(
    world: TowerWorld, red: Team, root: httpx.AsyncClient
) -> None:
    chief, me = red.clients[ADMIN], f"{red.path}/members/{red.people[ADMIN].id}"
    assert_problem(await chief.delete(me), 409, "last-team-admin")
    assert_problem(await chief.put(me, json={"role": "operator"}), 409, "last-team-admin")
    assert (await root.put(me, json={"role": "operator"})).status_code == 200
    assert_problem(await chief.patch(red.path, json={"name": "mine"}), 403, "team-admins-only")
    repaired = await root.put(f"{red.path}/members/{red.people[OPERATOR].id}", json={"role": "admin"})
    assert {one["user"]["name"]: one["role"] for one in repaired.json()["members"]} == {
        "Rowan-admin": "operator",
        "Rowan-observer": "observer",
        "Rowan-operator": "admin",
    }


async def test_an_invitation_says_nothing_of_who_there_is(world: TowerWorld, red: Team) -> None:
    chief, path = red.clients[ADMIN], f"{red.path}/invitations"
    elsewhere, silent = await world.add_user("Wanda"), await world.add_user("Silent")
    answers = {}
    for name in ("Wanda", "Nobody", "Silent"):
        answer = await chief.post(path, json={"name": name, "role": "operator"})
        assert answer.status_code == 201
        answers[name] = {key: value for key, value in answer.json().items() if key not in ("id", "name")}
        answers[name] = {key: value[:16] if "_at" in key else value for key, value in answers[name].items()}
    assert answers["Wanda"] == answers["Nobody"] == answers["Silent"]
    # A decline is as invisible as a name that does not exist. The user is not invited again while the team reads
    # "invited".
    declines = await world.signed_in(silent)
    (waiting,) = (await declines.get("/api/v1/me/invitations")).json()
    assert (waiting["team"], waiting["invited_by"], waiting["role"]) == ("Rowan-team", "Rowan-admin", "operator")
    assert (await declines.post(f"/api/v1/me/invitations/{waiting['id']}/decline")).status_code == 204
    await chief.post(path, json={"name": "silent", "role": "admin"})
    assert (await declines.get("/api/v1/me/invitations")).json() == []
    invited = [one["name"] for one in (await chief.get(red.path)).json()["invitations"]]
    assert sorted(invited) == ["Nobody", "Silent", "Wanda"]
    assert (await red.clients[OPERATOR].get(red.path)).json()["invitations"] == []
    # It is for that user only, and expires in a week.
    joins = await world.signed_in(elsewhere)
    (waiting,) = (await joins.get("/api/v1/me/invitations")).json()
    other = f"/api/v1/me/invitations/{waiting['id']}/accept"
    assert_problem(await declines.post(other), 404, "unknown-invitation")
    world.clock.advance(timedelta(days=8).total_seconds())
    joins, chief = await world.signed_in(elsewhere), await world.signed_in(red.people[ADMIN])
    assert_problem(await joins.post(other), 404, "unknown-invitation")
    assert (await chief.get(red.path)).json()["invitations"] == []
    again = (await chief.post(path, json={"name": "Wanda", "role": "observer"})).json()
    assert (await chief.delete(f"{path}/{again['id']}")).status_code == 204
    assert_problem(await chief.delete(f"{path}/{again['id']}"), 404, "unknown-invitation")
    # The team sees its members.
    known = await chief.post(path, json={"name": "ROWAN-observer", "role": "admin"})
    assert_problem(known, 409, "member-already")


async def test_drones_go_in_by_their_owners_and_never_from_under_a_pilot(world: TowerWorld, red: Team) -> None:
    chief = red.clients[ADMIN]
    olga = await world.add_user("Olga")
    shared = await world.add_drone("shared", olga, red.people[ADMIN])
    theirs = await world.add_drone("theirs", olga)
    client = await world.signed_in(olga)
    assert_problem(await chief.put(f"{red.path}/drones/{theirs.id}"), 404, "unknown-drone")
    assert_problem(await chief.put(f"{red.path}/drones/999"), 404, "unknown-drone")
    await ask(client, shared.id, "acquire")
    assert_problem(await chief.put(f"{red.path}/drones/{shared.id}"), 409, "drone-in-use")
    await ask(client, shared.id, "release")
    assert (await chief.put(f"{red.path}/drones/{shared.id}")).status_code == 200
    # One team at a time. An owner can take it out, whoever added it.
    second = (await client.post("/api/v1/teams", json={"name": "second"})).json()["id"]
    assert_problem(await client.put(f"/api/v1/teams/{second}/drones/{shared.id}"), 409, "in-another-team")
    assert_problem(await client.get(red.path), 404, "unknown-team")
    assert (await client.delete(f"{red.path}/drones/{shared.id}")).status_code == 204
    assert_problem(await client.delete(f"{red.path}/drones/{red.drone_id}"), 404, "unknown-team")
    operator = red.clients[OPERATOR]
    assert_problem(await operator.put(f"{red.path}/drones/{shared.id}"), 403, "team-admins-only")
    for number in range(4):
        assert (await client.post("/api/v1/teams", json={"name": f"more {number}"})).status_code == 201
    assert_problem(await client.post("/api/v1/teams", json={"name": "too many"}), 409, "too-many-teams")


async def test_a_team_admin_lends_to_observers_of_the_team_alone(
    world: TowerWorld, red: Team, root: httpx.AsyncClient
) -> None:
    wanda = await world.add_user("Wanda")
    ends = {"until": (world.clock() + timedelta(hours=1)).isoformat()}
    chief, loans = red.clients[ADMIN], f"/api/v1/drones/{red.drone_id}/loans"
    observer, number = red.clients[OBSERVER], red.people[OBSERVER].id
    # A user outside the team and a missing user give the same response.
    assert_problem(await chief.put(f"{loans}/{wanda.id}", json=ends), 404, "unknown-user")
    assert_problem(await chief.put(f"{loans}/9999", json=ends), 404, "unknown-user")
    assert_problem(await chief.put(f"{loans}/{red.people[OPERATOR].id}", json=ends), 409, "owner-already")
    assert_problem(await red.clients[OPERATOR].put(f"{loans}/{number}", json=ends), 403, "admins-only")
    assert (await chief.put(f"{loans}/{number}", json=ends | {"radius_m": 50})).status_code == 200
    assert (await ask(observer, red.drone_id, "acquire")).json()["relation"] == "borrower"
    # The loan ends with the membership, as the controls do.
    assert (await chief.delete(f"{red.path}/members/{number}")).status_code == 204
    view = (await chief.get(f"/api/v1/drones/{red.drone_id}")).json()
    assert (view["loans"], view["holder"]) == ([], None)
    assert_problem(await ask(observer, red.drone_id, "acquire"), 404, "unknown-drone")
    # A loan by the tower can only be changed by the tower; a borrower from elsewhere learns of no team.
    await root.put(f"{loans}/{wanda.id}", json=ends)
    seen = (await (await world.signed_in(wanda)).get(f"/api/v1/drones/{red.drone_id}")).json()
    assert (seen["relation"], seen["team"]) == ("borrower", None)
    await root.put(f"{red.path}/members/{wanda.id}", json={"role": "observer"})
    assert_problem(await chief.put(f"{loans}/{wanda.id}", json=ends), 403, "admins-only")
    actions = {one["action"] for one in await audit(root, "team.")}
    assert {"team.created", "team.invited", "team.member_added", "team.member_removed", "team.drone_added"} <= actions
