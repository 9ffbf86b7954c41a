"""Alerts over REST and the live channel: the same for everybody, acknowledged once, kept over a restart."""

from collections.abc import AsyncIterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import ObedientAgent, ask, audit, live, until
from sqlalchemy import select
from tower_world import NewDrone, TowerWorld, assert_problem, start_tower

from server.alerts.core.rules import RULES
from server.alerts.store.tables import AlertRow
from server.kernel.people import Role

ALERTS = "/api/v1/alerts"


class Scene:
    """Anna and Bert own hawk, which flies and which nobody holds; Olga may watch it; Mallory has no drone."""

    def __init__(self, world: TowerWorld, drone: NewDrone, clients: dict[str, httpx.AsyncClient]) -> None:
        self.world, self.drone, self.clients = world, drone, clients
        self.agent = ObedientAgent(world.tower.hub, drone.id)

    async def opened(self, rule: str) -> dict[str, Any]:
        """Waits until such an alert is open, and returns it as Bert reads it."""
        hub = self.world.tower.hub
        await until(rule, lambda: any(one.rule.name == rule and not one.closed_at for one in hub.alerts.live()))
        found: list[dict[str, Any]] = (await self.clients["Bert"].get(ALERTS, params={"rule": rule})).json()
        return found[0]

    async def is_stored(self) -> None:
        await until("the alerts to be stored", lambda: not self.world.tower.alert_writer.waiting())


async def _scene(world: TowerWorld) -> Scene:
    people = {name: await world.add_user(name) for name in ("Anna", "Bert", "Mallory")}
    people["Olga"] = await world.add_user("Olga", Role.OBSERVER)
    people["Root"] = await world.add_user("Root", Role.ADMIN)
    drone = await world.add_drone("hawk", people["Anna"], people["Bert"], people["Olga"])
    return Scene(world, drone, {name: await world.signed_in(person) for name, person in people.items()})


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        yield await _scene(world)


async def test_one_alert_is_opened_acknowledged_and_closed_for_everybody(scene: Scene) -> None:
    anna, bert, olga, root = (scene.clients[name] for name in ("Anna", "Bert", "Olga", "Root"))
    async with live(scene.world, bert) as berts, live(scene.world, olga) as olgas:
        scene.agent.state(armed=True, airborne=True)
        opened = [(await screen.event("alert"))["alert"] for screen in (berts, olgas)]
        assert opened[0] == opened[1]
        alert = opened[0]
        assert (alert["rule"], alert["severity"], alert["drone_id"]) == ("unattended", "warning", scene.drone.id)
        assert alert["words"] == "hawk is in the air, and nobody has the controls."
        assert (alert["acknowledged_at"], alert["closed_at"]) == (None, None)

        path = f"{ALERTS}/{alert['id']}/acknowledge"
        answer = await anna.post(path)
        assert (answer.status_code, answer.json()["acknowledged_by"]["name"]) == (200, "Anna")
        for screen in (berts, olgas):
            assert (await screen.event("alert"))["alert"] == answer.json()
        assert (await bert.post(path)).json() == answer.json(), "the first one counts"

        assert (await ask(anna, scene.drone.id, "acquire")).status_code == 200
        for screen in (berts, olgas):
            over = (await screen.event("alert"))["alert"]
            assert (over["id"], over["closed_at"] is None) == (alert["id"], False)
    assert (await anna.post(path)).status_code == 404, "a warning that is over needs nobody"
    await scene.is_stored()
    (row,) = await audit(root, "alert.")
    assert (row["action"], row["actor_name"], row["drone_id"]) == ("alert.acknowledged", "Anna", scene.drone.id)
    assert row["detail"]["rule"] == "unattended"
    assert row["request_id"] == answer.headers["X-Request-Id"]
    (past,) = (await olga.get(ALERTS, params={"state": "closed"})).json()
    assert past == over


async def test_an_observer_sees_and_a_stranger_does_not(scene: Scene) -> None:
    olga, mallory = scene.clients["Olga"], scene.clients["Mallory"]
    scene.agent.state(armed=True, airborne=True)
    alert = await scene.opened("unattended")
    path = f"{ALERTS}/{alert['id']}/acknowledge"
    assert [one["id"] for one in (await olga.get(ALERTS)).json()] == [alert["id"]]
    assert_problem(await olga.post(path), 403, "read-only-account")
    unknown = assert_problem(await mallory.post(path), 404, "unknown-alert")
    never = assert_problem(await mallory.post(f"{ALERTS}/1/acknowledge"), 404, "unknown-alert")
    assert unknown["detail"] == never["detail"]
    for params in ({}, {"drone_id": scene.drone.id}, {"state": "open"}, {"before": alert["id"]}):
        assert (await mallory.get(ALERTS, params=params)).json() == []
    async with live(scene.world, mallory) as screen:
        assert not [event for event in screen.events if event["type"] == "alert"]
    listed = (await mallory.get(f"{ALERTS}/rules")).json()
    assert [one["name"] for one in listed] == [rule.name for rule in RULES]


async def test_what_is_open_or_unseen_outlives_the_tower(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        scene = await _scene(world)
        scene.agent.state(armed=True, airborne=True)
        seen = await scene.opened("unattended")
        assert (await scene.clients["Anna"].post(f"{ALERTS}/{seen['id']}/acknowledge")).status_code == 200
        world.tower.hub.detach_link(scene.agent.link)
        lost = await scene.opened("link-lost")
    async with start_tower(tmp_path) as world:
        bert = await world.signed_in("Bert")
        scene.world, scene.clients = world, {"Bert": bert}
        kept = {one["rule"]: one for one in (await bert.get(ALERTS, params={"state": "open"})).json()}
        assert kept.keys() == {"unattended", "link-lost"}
        assert kept["link-lost"] == lost
        assert kept["unattended"]["acknowledged_by"]["name"] == "Anna"
        async with live(world, bert) as screen:
            agent = ObedientAgent(world.tower.hub, scene.drone.id)
            agent.state(armed=False, airborne=False)
            over = [(await screen.event("alert"))["alert"] for _ in kept]
            assert {one["id"] for one in over} == {one["id"] for one in kept.values()}
            assert all(one["closed_at"] for one in over)
    async with start_tower(tmp_path) as world:
        bert = await world.signed_in("Bert")
        (waiting,) = world.tower.hub.alerts.live()
        assert waiting.id == lost["id"], "critical, over, and nobody has seen to it"
        assert (await bert.post(f"{ALERTS}/{lost['id']}/acknowledge")).status_code == 200
        assert world.tower.hub.alerts.live() == []
        world.clock.advance(1)
    async with start_tower(tmp_path) as world:
        assert world.tower.hub.alerts.live() == []


async def test_alerts_go_on_without_the_database(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = scene.world.tower.alert_writer
    write = writer._write_once
    tries = 0

    async def broken() -> None:
        nonlocal tries
        tries += 1
        raise OSError("no space left on device")

    monkeypatch.setattr("server.alerts.store.writer.TRY_AGAIN_AFTER_S", 0.01)
    monkeypatch.setattr(writer, "_write_once", broken)
    scene.agent.state(armed=True, airborne=True)
    alert = await scene.opened("unattended")
    answer = await scene.clients["Anna"].post(f"{ALERTS}/{alert['id']}/acknowledge")
    assert answer.status_code == 200
    await until("some tries", lambda: tries > 2)
    monkeypatch.setattr(writer, "_write_once", write)
    await scene.is_stored()
    async with scene.world.database.reading() as session:
        (row,) = (await session.scalars(select(AlertRow))).all()
    assert (row.id, row.acknowledged_by_name) == (alert["id"], "Anna")
    assert len(await audit(scene.clients["Root"], "alert.")) == 1


async def test_the_list_has_filters_and_pages(scene: Scene) -> None:
    now = scene.world.clock()
    async with scene.world.database.writing() as session:
        for number in range(30):
            session.add(
                AlertRow(
                    id=number,
                    rule="link-lost" if number % 2 else "gone-since",
                    subject="",
                    severity="critical" if number % 2 else "notice",
                    badge="x",
                    drone_id=scene.drone.id if number < 24 else 9_999,
                    about_stranger=False,
                    words="x",
                    opened_at=now - timedelta(minutes=number),
                    acknowledged_at=now if number == 4 else None,
                    closed_at=now,
                )
            )
    anna = scene.clients["Anna"]

    async def ids(**params: Any) -> list[int]:
        return [one["id"] for one in (await anna.get(ALERTS, params=params)).json()]

    assert await ids() == list(range(24))
    assert await ids(limit=5, before=4) == [5, 6, 7, 8, 9]
    assert await ids(before=23) == []
    assert await ids(before=5_000) == []
    assert await ids(severity="critical", limit=3) == [1, 3, 5]
    assert await ids(rule="gone-since", limit=2) == [0, 2], "of a rule that this version does not have"
    assert await ids(acknowledged=True) == [4]
    assert await ids(state="open") == []
    assert await ids(drone_id=9_999) == []
    since, until_at = (now - timedelta(minutes=6)).isoformat(), (now - timedelta(minutes=3)).isoformat()
    assert await ids(since=since, until=until_at) == [4, 5, 6]
    assert (await anna.get(ALERTS, params={"limit": 501})).status_code == 422


async def test_metrics_count_what_is_open(scene: Scene) -> None:
    scene.agent.state(armed=True, airborne=True)
    await scene.opened("unattended")
    text = (await scene.clients["Root"].get("/metrics")).text
    assert 'tower_alerts_open{severity="warning"} 1.0' in text
    assert 'tower_alerts_open{severity="critical"} 0.0' in text
    assert 'tower_alerts_opened_total{severity="warning"} 1.0' in text
