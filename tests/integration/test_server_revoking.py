"""A user who loses the right to a drone loses its controls: the epoch grows, so their earlier messages are stale."""

from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import ObedientAgent, ask, audit, live, until
from sqlalchemy.exc import OperationalError
from tower_world import Person, TowerWorld, assert_problem, start_tower

from server.accounts.store.users import UserChange, change_user
from server.audit.store.action import AuditAction
from server.audit.store.trail import COMMAND_LINE
from server.kernel.people import Role
from server.live.hub_events import (
    HolderExpired,
    HolderGone,
    OfferLapsed,
    RightLost,
    RttTooLong,
    TurnRequested,
)
from wire.ids import DroneId, UserId


@pytest.fixture
async def world(tmp_path: Path):
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def anna(world: TowerWorld) -> Person:
    return await world.add_user("Anna")


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


async def seen(admin: httpx.AsyncClient, drone_id: int) -> dict[str, Any]:
    answer: dict[str, Any] = (await admin.get(f"/api/v1/drones/{drone_id}")).json()
    return answer


async def notice(world: TowerWorld, event: Any) -> None:
    """Reports the event as if the hub had noticed it."""
    world.tower.event_handler.noticed(event)
    await world.tower.event_handler.caught_up()


@pytest.mark.parametrize("way", ["disabled", "deleted", "unassigned"])
async def test_the_controls_are_revoked(world: TowerWorld, anna: Person, root: httpx.AsyncClient, way: str) -> None:
    hawk = await world.add_drone("hawk", anna)
    agent = ObedientAgent(world.tower.hub, hawk.id)
    operator = await world.signed_in(anna)
    held = (await ask(operator, hawk.id, "acquire")).json()
    assert held["holder"] == {"id": anna.id, "name": "Anna"}

    if way == "disabled":
        answer = await root.patch(f"/api/v1/users/{anna.id}", json={"disabled": True})
    elif way == "deleted":
        answer = await root.delete(f"/api/v1/users/{anna.id}")
    else:
        answer = await root.delete(f"/api/v1/drones/{hawk.id}/owners/{anna.id}")
    assert answer.is_success, answer.text

    after = await seen(root, hawk.id)
    assert (after["holder"], after["epoch"]) == (None, held["epoch"] + 1)
    assert [order.epoch for order in agent.decided_holds] == [after["epoch"]]
    again = await ask(operator, hawk.id, "acquire")
    if way == "unassigned":
        assert_problem(again, 404, "unknown-drone")
    else:
        assert_problem(again, 401, "session-expired")
    (revoked,) = await audit(root, "control.revoke")
    assert revoked["detail"]["epoch"] == after["epoch"]
    assert revoked["detail"]["reason"]


async def test_whoever_loses_the_ownership_reads_who_and_why(
    world: TowerWorld, anna: Person, root: httpx.AsyncClient
) -> None:
    hawk = await world.add_drone("hawk", anna)
    operator = await world.signed_in(anna)
    await ask(operator, hawk.id, "acquire")
    async with live(world, operator) as hers, live(world, root) as admins:
        await root.delete(f"/api/v1/drones/{hawk.id}/owners/{anna.id}")
        await hers.event("drone_removed", drone_id=hawk.id)
        for screen in (hers, admins):
            reported = await screen.event("control", drone_id=hawk.id, event="revoked")
            assert (reported["by"]["name"], reported["reason"]) == ("Root", "no longer an owner of this drone")
            assert (reported["holder"], reported["epoch"]) == (None, 2)
        # She must not learn what happens to the drone afterwards.
        await ask(root, hawk.id, "take")
        await admins.event("control", event="taken")
        await hers.socket.send("{}")
        await hers.event("notice", code="malformed")  # all earlier messages have been read
        assert not [event for event in hers.events if event["type"] in ("control", "hold", "drone")]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"disabled": True}, "the account was disabled"),
        ({"password": "another long password"}, "an admin has set a new password"),
        ({"role": "admin"}, "the account is now that of an admin"),
        (None, "the account was disabled"),
    ],
    ids=["disabled", "password", "role", "deleted"],
)
async def test_a_closed_browser_is_told_why(
    world: TowerWorld, anna: Person, root: httpx.AsyncClient, change: dict[str, Any] | None, why: str
) -> None:
    operator = await world.signed_in(anna)
    async with live(world, operator) as screen:
        path = f"/api/v1/users/{anna.id}"
        answer = await (root.delete(path) if change is None else root.patch(path, json=change))
        assert answer.is_success
        await screen.socket.wait_closed()
        assert (screen.socket.close_code, screen.socket.close_reason) == (4401, why)


async def test_an_ended_session_is_told_so(world: TowerWorld, anna: Person) -> None:
    operator = await world.signed_in(anna)
    async with live(world, operator) as screen:
        await operator.delete("/api/v1/session")
        await screen.socket.wait_closed()
        assert (screen.socket.close_code, screen.socket.close_reason) == (4401, "the session has ended")


async def test_what_another_process_withdraws_is_revoked_too(
    world: TowerWorld, anna: Person, root: httpx.AsyncClient
) -> None:
    """`tower user disable` writes to the database and notifies nobody."""
    hawk = await world.add_drone("hawk", anna)
    operator = await world.signed_in(anna)
    await ask(operator, hawk.id, "acquire")
    async with world.database.writing() as session:
        action = AuditAction(by=COMMAND_LINE, at=world.clock())
        await change_user(session, user_id=anna.id, change=UserChange(disabled=True), action=action)
    drone = world.tower.hub.state.drones.get(DroneId(hawk.id))
    assert drone is not None
    await until("the revocation", lambda: drone.lease.holder is None)
    assert (await seen(root, hawk.id))["epoch"] == 2


async def test_a_demoted_admin_does_not_keep_what_is_not_theirs(
    world: TowerWorld, anna: Person, root: httpx.AsyncClient
) -> None:
    hawk = await world.add_drone("hawk", anna)
    second = await world.add_user("Second", Role.ADMIN)
    other = await world.signed_in(second)
    held = (await ask(other, hawk.id, "take")).json()
    assert held["holder"]["id"] == second.id
    await root.patch(f"/api/v1/users/{second.id}", json={"role": "operator"})
    after = await seen(root, hawk.id)
    assert (after["holder"], after["epoch"]) == (None, held["epoch"] + 1)
    assert_problem(await other.get(f"/api/v1/drones/{hawk.id}"), 404, "unknown-drone")


async def test_a_demoted_admin_stops_assisting(world: TowerWorld, anna: Person, root: httpx.AsyncClient) -> None:
    hawk = await world.add_drone("hawk", anna)
    second = await world.add_user("Second", Role.ADMIN)
    operator, other = await world.signed_in(anna), await world.signed_in(second)
    await ask(operator, hawk.id, "acquire")
    await ask(other, hawk.id, "assist")
    await root.patch(f"/api/v1/users/{second.id}", json={"role": "operator"})
    after = await seen(root, hawk.id)
    assert (after["holder"]["name"], after["assistant"], after["epoch"]) == ("Anna", None, 3)


async def test_who_was_shut_out_and_is_no_owner_any_more_is_forgotten(
    world: TowerWorld, anna: Person, root: httpx.AsyncClient
) -> None:
    hawk = await world.add_drone("hawk", anna)
    operator = await world.signed_in(anna)
    await ask(operator, hawk.id, "acquire")
    await ask(root, hawk.id, "take")
    await ask(root, hawk.id, "give")
    after = (await root.delete(f"/api/v1/drones/{hawk.id}/owners/{anna.id}")).json()
    assert (after["holder"]["name"], after["taken_from"], after["offered"]) == ("Root", None, False)


async def test_an_admin_who_is_no_longer_an_owner_keeps_the_controls(world: TowerWorld) -> None:
    root = await world.add_user("Root", Role.ADMIN)
    hawk = await world.add_drone("hawk", root)
    admin = await world.signed_in(root)
    held = (await ask(admin, hawk.id, "acquire")).json()
    after = (await admin.delete(f"/api/v1/drones/{hawk.id}/owners/{root.id}")).json()
    assert after["holder"] == held["holder"]


async def test_signing_out_of_the_last_session_with_a_browser_revokes(
    world: TowerWorld, anna: Person, root: httpx.AsyncClient
) -> None:
    hawk = await world.add_drone("hawk", anna)
    agent = ObedientAgent(world.tower.hub, hawk.id)
    first, second = await world.signed_in(anna), await world.signed_in(anna)
    await ask(first, hawk.id, "acquire")
    async with live(world, first), live(world, second):
        await second.delete("/api/v1/session")
        await world.tower.event_handler.caught_up()
        assert (await seen(root, hawk.id))["holder"]["name"] == "Anna"
        await first.delete("/api/v1/session")
        await world.tower.event_handler.caught_up()
        assert (await seen(root, hawk.id))["holder"] is None
    assert [order.reason for order in agent.decided_holds] == ["the holder's session has ended"]


async def test_events_of_the_hub_change_the_lease_and_are_recorded(
    world: TowerWorld, anna: Person, root: httpx.AsyncClient
) -> None:
    hawk = await world.add_drone("hawk", anna)
    drone_id, user_id = DroneId(hawk.id), UserId(anna.id)
    agent = ObedientAgent(world.tower.hub, hawk.id)
    agent.state(armed=True, airborne=True)
    operator = await world.signed_in(anna)
    await ask(operator, hawk.id, "acquire")
    await notice(world, HolderGone(drone_id, user_id, 2.0))
    await notice(world, RttTooLong(drone_id, 731.4))
    assert [order.reason for order in agent.decided_holds] == [
        "the holder has been gone for 2 s",
        "the round trip takes 731 ms",
    ]
    assert (await seen(root, hawk.id))["epoch"] == 1
    await ask(root, hawk.id, "assist")
    async with live(world, operator) as screen:
        await notice(world, TurnRequested(drone_id, "assistant"))
        await screen.event("turn", drone_id=hawk.id)
    assert (await seen(root, hawk.id))["epoch"] == 3
    await ask(root, hawk.id, "take")
    await ask(root, hawk.id, "give")
    await notice(world, OfferLapsed(drone_id))
    lapsed = await seen(root, hawk.id)
    assert (lapsed["holder"]["name"], lapsed["taken_from"]["name"], lapsed["offered"]) == ("Root", "Anna", False)
    actions = [one["action"] for one in await audit(root, "control.")]
    assert actions == [
        "control.offer-lapsed",
        "control.give",
        "control.take",
        "control.turn",
        "control.assist",
        "control.round_trip_too_long",
        "control.holder_gone",
        "control.acquire",
    ]


async def test_a_holder_who_stays_away_loses_the_controls(
    world: TowerWorld, anna: Person, root: httpx.AsyncClient
) -> None:
    hawk = await world.add_drone("hawk", anna)
    agent = ObedientAgent(world.tower.hub, hawk.id)
    agent.state(armed=True, airborne=True)
    operator = await world.signed_in(anna)
    await ask(operator, hawk.id, "acquire")
    expired = HolderExpired(DroneId(hawk.id), UserId(anna.id))
    async with live(world, operator):
        await notice(world, expired)  # noticed just before they came back
        assert (await seen(root, hawk.id))["holder"]["name"] == "Anna"
    drone = world.tower.hub.state.drones.get(DroneId(hawk.id))
    assert drone is not None
    await until("the hub to miss the holder", lambda: drone.holder_watch.missing_since is not None)
    await notice(world, expired)
    after = await seen(root, hawk.id)
    assert (after["holder"], after["epoch"]) == (None, 2)
    assert agent.holds == []  # a flight by hand was held long before, and automatic flight continues


async def test_what_comes_too_late_changes_nothing(world: TowerWorld, anna: Person, root: httpx.AsyncClient) -> None:
    hawk = await world.add_drone("hawk", anna)
    operator = await world.signed_in(anna)
    await ask(operator, hawk.id, "acquire")
    await ask(root, hawk.id, "take")
    drone_id, user_id = DroneId(hawk.id), UserId(anna.id)
    for late in (
        RightLost(drone_id, user_id, "holder", "signed out"),
        HolderExpired(drone_id, user_id),
        RightLost(drone_id, user_id, "assistant", "gone"),
        OfferLapsed(drone_id),
        TurnRequested(drone_id, "holder"),
        RightLost(DroneId(77), user_id, "holder", "there is no such drone"),
    ):
        await notice(world, late)
    after = await seen(root, hawk.id)
    assert (after["holder"]["name"], after["taken_from"]["name"], after["epoch"]) == ("Root", "Anna", 2)
    assert len(await audit(root, "control.")) == 2


async def test_without_a_database_the_drone_holds_first_and_the_lease_follows(
    world: TowerWorld, anna: Person, root: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    hawk = await world.add_drone("hawk", anna)
    agent = ObedientAgent(world.tower.hub, hawk.id)
    operator = await world.signed_in(anna)
    await ask(operator, hawk.id, "acquire")
    event_handler = world.tower.event_handler
    monkeypatch.setattr(event_handler, "_try_again_after_s", 0.01)
    writing, failures = world.database.writing, iter([OSError("disk full"), OperationalError("x", {}, OSError())])

    def out_of_reach(**how: bool) -> Any:
        for failure in failures:
            raise failure
        return writing(**how)

    monkeypatch.setattr(world.database, "writing", out_of_reach)
    await notice(world, RightLost(DroneId(hawk.id), UserId(anna.id), "holder", "disabled"))
    assert [order.epoch for order in agent.holds] == [1, 2]
    assert "the database has not confirmed it" in agent.holds[0].reason
    assert (await seen(root, hawk.id))["holder"] is None


async def test_a_flood_of_events_is_bounded_and_holds(
    world: TowerWorld, anna: Person, monkeypatch: pytest.MonkeyPatch
) -> None:
    hawk = await world.add_drone("hawk", anna)
    agent = ObedientAgent(world.tower.hub, hawk.id)
    await ask(await world.signed_in(anna), hawk.id, "acquire")
    event_handler, drone = world.tower.event_handler, world.tower.hub.state.drones[DroneId(hawk.id)]
    monkeypatch.setattr("server.control.store.hub_event_handler.MAX_WAITING", 4)
    for number in range(20):
        event_handler.noticed(TurnRequested(drone.drone_id, "holder"))
        event_handler.noticed(RightLost(drone.drone_id, UserId(anna.id), "taken_from", f"reason {number}"))
    for number in range(20):
        event_handler.noticed(RightLost(drone.drone_id, UserId(anna.id), "holder", f"reason {number}"))
    assert drone.fenced, "the holder is shut out, however long the queue is"
    assert len(event_handler._waiting[drone.drone_id]) == 5
    await world.tower.event_handler.caught_up()
    assert (drone.lease.holder, drone.fenced) == (None, False)
    assert len(agent.decided_holds) == 1
