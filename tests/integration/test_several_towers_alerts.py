"""Alerts with two towers: pairs across them, alerts of a tower that has ended, and every delivery exactly once."""

import asyncio
import time
from collections import Counter
from dataclasses import replace
from math import cos, radians

import httpx
import pytest
import shared_bus_world
from alert_inbox import CHANNELS, Inbox
from control_world import DEADLINE_S, ObedientAgent, ask, live, until
from shared_bus_world import AUTOPILOT, Two, frame_of
from tower_world import TowerWorld, assert_problem

from server.airspace.core.separation.motion import METRES_PER_DEGREE
from server.alerts.core.left_alerts import GONE_FOR_S
from server.alerts.core.tower_facts import Disk, StoredThere
from server.alerts.store.left_behind import LeftBehind
from server.kernel.people import Role
from server.towers.core.place import Place
from wire.content import Frames
from wire.dialect import mavlink
from wire.ids import DroneId, Epoch

cluster, nats = shared_bus_world.cluster, shared_bus_world.nats
postgres, two = shared_bus_world.postgres, shared_bus_world.two


async def add_hook(inbox: Inbox, client: httpx.AsyncClient) -> None:
    answer = await client.post(CHANNELS, json=inbox.channel)
    assert answer.status_code == 201, answer.text


def fly_to(world: TowerWorld, drone_id: int, east_m: float) -> None:
    """The drone hovers there, as its autopilot says now."""
    lon_e7 = round((8.0 + east_m / METRES_PER_DEGREE / cos(radians(47.0))) * 1e7)
    position = mavlink.MAVLink_global_position_int_message(0, 470_000_000, lon_e7, 450_000, 50_000, 0, 0, 0, 0)
    hub = world.tower.hub
    frames = Frames(DroneId(drone_id), Epoch(1), 0, [frame_of(position, AUTOPILOT)])
    hub._paths.up(hub.state.drones[DroneId(drone_id)], frames, time.monotonic())


async def test_drones_of_two_towers_that_come_near_have_one_alert(two: Two) -> None:
    other = await two.b.add_drone("Hawk", two.owner)
    await until("a to know it", lambda: DroneId(other.id) in two.a.tower.hub.state.drones)
    agent = ObedientAgent(two.b.tower.hub, other.id)
    agent.state(armed=True, airborne=True)
    there = two.a.tower.hub.state.drones[DroneId(other.id)]
    await until("a to know its home", lambda: there.place is Place.ELSEWHERE)
    async with Inbox().listening() as inbox, live(two.a, await two.a.signed_in(two.owner)) as at_a:
        await add_hook(inbox, two.alice)
        flying = True

        async def fly() -> None:
            while flying:
                fly_to(two.a, two.drone.id, 0.0)
                fly_to(two.b, other.id, 5.0)
                await asyncio.sleep(0.2)

        task = asyncio.create_task(fly())
        began = time.monotonic()
        pair = [two.drone.id, other.id]
        at_home = await at_a.event("separation", drones=pair, level="warning")
        elsewhere = await two.alices.event("separation", drones=pair, level="warning")
        print(f"the warning about drones of two towers came after {time.monotonic() - began:.2f} s")
        assert at_home["number"] == elsewhere["number"]
        assert at_home["distance_m"] == pytest.approx(5.0, abs=0.5)
        await until("the webhook", lambda: inbox.of("too-near") == ["opened"])
        shown = (await two.alice.get("/api/v1/alerts", params={"rule": "too-near", "state": "open"})).json()
        assert [(one["drone_id"], one["other_id"]) for one in shown] == [tuple(pair)]
        agent.state(armed=False, airborne=False)
        await two.alices.event("separation", drones=pair, level="clear", why="landed")
        await until("its end", lambda: inbox.of("too-near") == ["opened", "closed"])
        flying = False
        await task
        assert max(Counter(inbox.told).values()) == 1, "each exactly once"


async def lands(two: Two) -> None:
    """So that no alert can begin before there is a hook for it."""
    two.agent.state(armed=False, airborne=False)
    alerts = two.a.tower.hub.alerts
    await until("the end of the flight", lambda: "unattended" not in {one.rule.name for one in alerts.live()})


async def test_alerts_of_a_tower_that_ends_go_on_at_another_and_are_announced_once(two: Two) -> None:
    rule = "unattended"
    await lands(two)
    async with Inbox().listening() as inbox:
        await add_hook(inbox, two.alice)
        two.agent.state(armed=True, airborne=True)
        await until("the beginning", lambda: inbox.of(rule) == ["opened"])
        (before,) = (await two.alice.get("/api/v1/alerts", params={"rule": rule, "state": "open"})).json()
        await two.end("a")
        await until("b to have the drone", lambda: two.at(two.b).place is Place.HERE)
        await until("b to have its alert", lambda: two.b.tower.hub.alerts.has(before["id"]))
        (after,) = (await two.alice.get("/api/v1/alerts", params={"rule": rule, "state": "open"})).json()
        assert after == before, "the same alert goes on"
        agent = ObedientAgent(two.b.tower.hub, two.drone.id)
        agent.state(armed=True, airborne=True)
        await until("the fence to be lifted", lambda: not two.at(two.b).fenced)
        assert (await ask(two.alice, two.drone.id, "acquire")).status_code == 200
        await until("the end", lambda: inbox.of(rule) == ["opened", "closed"])
        (over,) = (await two.alice.get("/api/v1/alerts", params={"rule": rule})).json()
        assert over["id"] == before["id"]
        assert over["closed_at"]
        assert max(Counter(inbox.told).values()) == 1, f"each exactly once: {inbox.told}"


async def test_what_nobody_answers_is_announced_once_though_its_tower_has_ended(two: Two) -> None:
    async with Inbox().listening() as inbox:
        await add_hook(inbox, two.root)
        two.agent.fall_silent()
        await until("the beginning", lambda: inbox.of("link-lost") == ["opened"])
        (lost,) = [one for one in two.a.tower.hub.alerts.live() if one.rule.name == "link-lost"]
        await two.end("a")
        await until("b to have it", lambda: two.b.tower.hub.alerts.has(lost.id))
        two.b.clock.advance(600)
        two.b.tower.alert_deliverer.wake()
        await until("nobody has answered", lambda: inbox.of("link-lost") == ["opened", "unanswered"])
        assert max(Counter(inbox.told).values()) == 1, f"each exactly once: {inbox.told}"


async def test_an_alert_of_another_tower_is_acknowledged(two: Two) -> None:
    await until("an alert at the drone's tower", lambda: bool(two.a.tower.hub.alerts.live()))
    (alert, *_) = two.a.tower.hub.alerts.live()
    assert not two.b.tower.hub.alerts.has(alert.id)
    answer = await two.alice.post(f"/api/v1/alerts/{alert.id}/acknowledge")
    assert answer.status_code == 200, answer.text
    assert answer.json()["acknowledged_by"]["name"] == "Alice"
    assert alert.acknowledged_at is not None
    assert_problem(await two.alice.post("/api/v1/alerts/1/acknowledge"), 404, "unknown-alert")
    mallory = await two.b.signed_in(await two.b.add_user("Mallory", Role.OPERATOR))
    assert_problem(await mallory.post(f"/api/v1/alerts/{alert.id}/acknowledge"), 404, "unknown-alert")


async def test_a_drone_that_moves_takes_its_alerts_along(two: Two) -> None:
    rule = "unattended"
    await lands(two)
    async with Inbox().listening() as inbox:
        await add_hook(inbox, two.alice)
        two.agent.state(armed=True, airborne=True)
        await until("the beginning", lambda: inbox.of(rule) == ["opened"])
        (alert,) = [one for one in two.a.tower.hub.alerts.live() if one.rule.name == rule]
        assert (await two.alice.post(f"/api/v1/alerts/{alert.id}/acknowledge")).status_code == 200
        await until("it to be stored", lambda: not two.a.tower.alert_writer.waiting())
        moved = ObedientAgent(two.b.tower.hub, two.drone.id)
        moved.state(armed=True, airborne=True)
        await until("b to have it", lambda: two.b.tower.hub.alerts.has(alert.id))
        await until("a to have it no more", lambda: not two.a.tower.hub.alerts.has(alert.id))
        (there,) = [one for one in two.b.tower.hub.alerts.live() if one.rule.name == rule]
        assert (there.id, there.acknowledged_at) == (alert.id, alert.acknowledged_at)
        await until("the fence to be lifted", lambda: not two.at(two.b).fenced)
        assert (await ask(two.alice, two.drone.id, "acquire")).status_code == 200
        async with asyncio.timeout(DEADLINE_S):
            while inbox.of(rule) != ["opened", "closed"]:  # noqa: ASYNC110  # the webhook's own task
                await asyncio.sleep(0.05)
        assert max(Counter(inbox.told).values()) == 1, f"each exactly once: {inbox.told}"


async def test_what_a_tower_leaves_behind_is_closed_with_a_reason_where_nobody_will_see_its_end(
    two: Two,
) -> None:
    hub = two.a.tower.hub
    rules = ("unattended", "link-lost", "tower-disk-full")
    left: dict[str, int] = {}
    # Nobody says so any more of a drone that is silent already.
    await until("it to be unattended", lambda: "unattended" in {one.rule.name for one in hub.alerts.live()})
    two.agent.fall_silent()

    def are_open() -> bool:
        # The tower looks at its real disk now and then.
        hub.alerts.tower_facts = replace(hub.alerts.tower_facts, disk=Disk(StoredThere.BOTH, 1), disk_low_bytes=2)
        left.update({one.rule.name: one.id for one in hub.alerts.live() if one.rule.name in rules})
        return len(left) == len(rules)

    await until("its alerts", are_open)
    await until("them to be stored", lambda: not two.a.tower.alert_writer.waiting())

    async def closed() -> dict[str, str]:
        stored = (await two.root.get("/api/v1/alerts")).json()
        return {one["rule"]: one["closed_why"] for one in stored if one["closed_at"] and one["id"] in left.values()}

    several = two.b.tower.several
    assert several is not None
    await until("b to know them", lambda: len(several.alert_subjects() or ()) == 2)
    look = LeftBehind(
        *(two.b.tower.hub, two.b.tower.database, two.b.tower.clock, two.b.tower.alert_writer, two.b.tower.announcer),
        alert_towers=several.alert_subjects,
        is_first=several.is_first,
    )
    assert await look.look(0.0) == await look.look(10 * GONE_FOR_S) == 0, "its tower is there"
    await two.end("a")
    await until("b to have the drone", lambda: two.at(two.b).place is Place.HERE)
    await until("b to have its alerts", lambda: two.b.tower.hub.alerts.has(left["unattended"]))
    await until("b to be the only tower", lambda: len(several.alert_subjects() or ()) == 1)
    assert await look.look(20 * GONE_FOR_S) == 0
    assert await look.look(21 * GONE_FOR_S - 1) == 0
    assert await closed() == {}
    assert await look.look(21 * GONE_FOR_S) == 2
    await until("them to be stored", lambda: not two.b.tower.alert_writer.waiting())
    assert await closed() == {
        "unattended": "The tower that saw it is gone, and no tower has heard Kestrel for 12 hours since.",
        "tower-disk-full": "The tower that it is about has been gone for 12 hours.",
    }
    lost = (await two.alice.get("/api/v1/alerts", params={"rule": "link-lost", "state": "open"})).json()
    assert [(one["id"], one["closed_why"]) for one in lost] == [(left["link-lost"], "")], "it is still lost"
    assert await look.look(22 * GONE_FOR_S) == 0
