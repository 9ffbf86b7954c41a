"""Plans over REST: who may read and write them, what is refused before anything is sent, and the reports."""

import asyncio
import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import ask, audit, live, until
from flying_scene import Scene
from tower_world import assert_problem, start_tower

from wire.control_messages import AutopilotState
from wire.plans import PlanItem, PlanKind, plan_hash
from wire.transactions import Outcome, PlanUploadWork

ROWS = [[22, 3, [0, 0, 0, None], 0, 0, 20.0, 1], [16, 3, [0, 0, 0, 0.1], 470001000, 80001000, 30.0, 1]]
ITEMS = tuple(PlanItem(*row) for row in ROWS)  # type: ignore[arg-type]


class PlanScene(Scene):
    async def put(self, client: httpx.AsyncClient | None = None, kind: str = "mission", **body: Any) -> httpx.Response:
        return await (client or self.holder).put(f"{self.path}/{kind}", json={"items": ROWS} | body)


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[PlanScene]:
    async with start_tower(tmp_path) as world:
        scene = PlanScene(world)
        await scene.begin()
        yield scene


async def test_a_plan_goes_on_board_and_everybody_who_watches_sees_which_it_is(scene: PlanScene) -> None:
    async with live(scene.world, scene.watcher) as watching:
        answer = await scene.put()
        assert answer.status_code == 200, answer.text
        operation = answer.json()
        assert (operation["state"], operation["work"], operation["kind"]) == ("done", "plan_upload", "mission")
        assert operation["by"]["name"] == "alice"
        assert operation["hash"] == plan_hash(PlanKind.MISSION, ITEMS)
        assert scene.agent.asked[0].work == PlanUploadWork(PlanKind.MISSION, ITEMS)
        assert scene.agent.asked[0].epoch == 1
        board = await watching.event("plan_on_board", state="known")
        assert (board["hash"], board["count"]) == (operation["hash"], 2)
        reported = await watching.event("operation")
        while reported["operation"]["state"] == "running":
            reported = await watching.event("operation")
        assert reported["operation"] == operation
    plan = (await scene.watcher.get(f"{scene.path}/mission")).json()
    assert (plan["state"], plan["count"], plan["fit_to_fly"]) == ("known", 2, True)
    assert plan["items"] == [[*row[:2], list(item.params), *row[3:]] for row, item in zip(ROWS, ITEMS, strict=True)]
    assert (await scene.watcher.get(f"/api/v1/operations/{operation['id']}")).json() == operation
    assert (await scene.watcher.get(f"{scene.path}/fence")).json()["state"] == "unknown"


async def test_it_can_be_read_anew_compared_and_cleared(scene: PlanScene) -> None:
    await scene.put()
    scene.agent.plans[PlanKind.MISSION] = ITEMS[:1]  # changed by another program
    fresh = (await scene.watcher.get(f"{scene.path}/mission?fresh=true")).json()
    assert (fresh["count"], fresh["hash"]) == (1, plan_hash(PlanKind.MISSION, ITEMS[:1]))
    other = await scene.watcher.post(f"{scene.path}/mission/verify", json={"items": ROWS})
    assert (other.json()["state"], other.json()["words"]) == ("failed", "The plan on board is another.")
    same = await scene.watcher.post(f"{scene.path}/mission/verify", json={"items": ROWS[:1]})
    assert same.json()["state"] == "done"
    assert (await scene.holder.delete(f"{scene.path}/mission?while_flying=true")).json()["state"] == "done"
    assert (await scene.watcher.get(f"{scene.path}/mission")).json()["items"] == []


async def test_one_that_is_only_begun_can_be_followed_and_stopped(scene: PlanScene) -> None:
    scene.agent.waits = True
    begun = await scene.holder.put(
        f"{scene.path}/mission", json={"items": ROWS}, headers={"Prefer": "respond-async, wait=10"}
    )
    assert begun.status_code == 202
    assert begun.headers["Preference-Applied"] == "respond-async"
    path = f"/api/v1/operations/{begun.json()['id']}"
    assert_problem(await scene.watcher.delete(path), 409, "not-in-control")
    assert_problem(await scene.put(), 409, "drone-busy")
    assert_problem(await scene.holder.put(f"{scene.path}/fence", json={"items": []}), 409, "drone-busy")
    stopped = await scene.holder.delete(path)
    assert stopped.status_code == 202
    operation = scene.world.tower.hub.operations.find(int(begun.json()["id"]))
    await until("the end", lambda: operation.state != "running")
    assert (await scene.holder.get(path)).json()["state"] == "cancelled"


async def test_only_the_holder_writes_and_a_stranger_finds_nothing(scene: PlanScene) -> None:
    assert_problem(await scene.put(scene.watcher), 409, "not-in-control")
    assert_problem(await scene.put(scene.admin), 409, "not-in-control")
    assert_problem(await scene.watcher.delete(f"{scene.path}/mission"), 409, "not-in-control")
    stranger = await scene.world.signed_in(await scene.world.add_user("mallory"))
    done = (await scene.put()).json()
    for answer in (
        await scene.put(stranger),
        await stranger.get(f"{scene.path}/mission"),
        await stranger.get(f"{scene.path}/mission?fresh=true"),
    ):
        assert_problem(answer, 404, "unknown-drone")
    for method in ("GET", "DELETE"):
        answer = await stranger.request(method, f"/api/v1/operations/{done['id']}")
        assert_problem(answer, 404, "unknown-operation")
    assert len(scene.agent.asked) == 1


async def test_a_token_flies_as_its_owner_may_and_one_for_watching_only_reads(scene: PlanScene) -> None:
    for scope, status in (("watch", 403), ("fly", 200)):
        asked = {"name": scope, "scopes": [scope]}
        secret = (await scene.holder.post("/api/v1/tokens", json=asked)).json()["secret"]
        program = await scene.world.client(headers={"Authorization": f"Bearer {secret}"})
        assert (await scene.put(program)).status_code == status


async def test_whoever_assists_gets_the_turn_first_and_the_holder_waits(scene: PlanScene) -> None:
    assert (await ask(scene.admin, scene.drone.id, "assist")).status_code == 200
    scene.agent.waits = True
    writing = asyncio.create_task(scene.put(scene.admin))
    await until("the upload", lambda: scene.agent.asked)
    lease = scene.world.tower.hub.state.drones.get(scene.drone.id).lease
    assert scene.agent.asked[0].epoch == lease.epoch > 1
    assert_problem(await scene.put(kind="fence"), 409, "assisted")
    assert scene.world.tower.hub.state.drones.get(scene.drone.id).lease.epoch == lease.epoch
    scene.agent.go_on()
    assert (await writing).json()["state"] == "done"


@pytest.mark.parametrize(
    ("items", "item", "field"),
    [
        ([ROWS[0], [16, 3, [0, 0, 0], 0, 0, 0, 1]], 1, "items.1.2"),
        ([[16]], 0, "items.0"),
        ([[16, 3, [0, 0, 0, 0], 2**31, 0, 0, 1]], 0, "items.0.3"),
        ([[16, 3, [0, 0, 0, 0], 0, 0, 1e39, 1]], 0, "items.0"),
        ([ROWS[0]] * 725, None, "items"),
    ],
    ids=["three parameters", "cut short", "no place", "too large", "too many"],
)
async def test_what_is_no_plan_is_refused_by_its_item(
    scene: PlanScene, items: list[Any], item: int | None, field: str
) -> None:
    problem = assert_problem(await scene.put(items=items), 422, "invalid-request")
    assert problem.get("item") == item
    assert problem["errors"][0]["field"] == field
    assert scene.agent.asked == []


async def test_bodies_have_their_bounds(scene: PlanScene) -> None:
    whole = await scene.put(items=[[16, 3, [-1.25e-30, 0.1, 0.1, None], -470001000, -80001000, 30.123456789, 1]] * 724)
    assert whole.json()["state"] == "done", whole.text
    long = json.dumps(
        {"items": [[16, 3, [-1.25e-30, 0.1, 0.1, None], -470001000, -80001000, 30.12, 1]] * 724}, indent=1
    )
    foreseen = await scene.holder.post(
        f"{scene.path}/mission/kept", content=long, headers={"Content-Type": "application/json"}
    )
    assert len(long) > 64 * 1024 and foreseen.status_code == 200, foreseen.text
    text = {"Content-Type": "application/json"}
    assert_problem(
        await scene.holder.put(f"{scene.path}/mission", content=b'{"items":' + b" " * 600_000 + b"[]}", headers=text),
        413,
        "too-large",
    )
    broken = await scene.holder.put(f"{scene.path}/mission", content=b"{", headers=text)
    assert_problem(broken, 400, "malformed-json")


async def test_a_borrowers_plan_keeps_the_limits_of_the_loan(scene: PlanScene) -> None:
    carol = await scene.lend_to_carol(max_height_m=50, radius_m=200)
    assert (await scene.put(carol)).json()["state"] == "done"
    far = assert_problem(
        await scene.put(carol, items=[ROWS[0], [16, 3, [0, 0, 0, 0], 471000000, 80000000, 30, 1]]), 409, "loan"
    )
    assert far["item"] == 1
    assert "item 2: kestrel is lent to you within 200 m" in far["detail"]
    high = await scene.put(carol, items=[[22, 3, [0, 0, 0, 0], 0, 0, 60, 1]])
    assert assert_problem(high, 409, "loan")["item"] == 0
    assert_problem(await scene.put(carol, kind="fence", items=[]), 409, "loan")
    assert len(scene.agent.asked) == 1


async def test_an_agent_that_is_not_there_or_too_old_is_not_asked(scene: PlanScene) -> None:
    scene.agent.link.takes = frozenset()
    assert_problem(await scene.put(), 409, "agent-too-old")
    scene.world.tower.hub.detach_link(scene.agent.link)
    assert_problem(await scene.put(), 409, "drone-offline")
    assert_problem(await scene.watcher.get(f"{scene.path}/mission?fresh=true"), 409, "drone-offline")


async def test_what_the_agent_refuses_to_read_is_told(scene: PlanScene) -> None:
    scene.agent.answer_with = lambda _: {"outcome": Outcome.REFUSED, "words": "Another ground station is reading."}
    busy = await scene.watcher.get(f"{scene.path}/mission?fresh=true")
    assert assert_problem(busy, 409, "drone-busy")["detail"] == "Another ground station is reading."
    scene.agent.answer_with = lambda _: {"outcome": Outcome.FAILED, "words": "It does not answer."}
    failed = await scene.watcher.get(f"{scene.path}/mission?fresh=true")
    assert assert_problem(failed, 409, "plan-not-read")["detail"] == "It does not answer."


async def test_whoever_is_shut_out_without_the_view_sees_no_plan_either(scene: PlanScene) -> None:
    await scene.put()
    async with live(scene.world, scene.holder) as watching:
        assert (await ask(scene.admin, scene.drone.id, "take", watch=False)).status_code == 200
        assert_problem(await scene.holder.get(f"{scene.path}/mission"), 403, "view-taken")
        drone = (await scene.holder.get(scene.path)).json()
        assert (drone["may_watch"], drone["plans"]["mission"]["state"]) == (False, "unknown")
        assert (await scene.put(scene.admin, items=ROWS[:1])).json()["state"] == "done"
        assert (await ask(scene.admin, scene.drone.id, "give")).status_code == 200
        await watching.event("control", event="given")
        assert not [one for one in watching.events if one["type"] in ("operation", "plan_on_board")]
    assert (await scene.watcher.get(f"{scene.path}/mission")).status_code == 200


async def test_what_was_written_is_in_the_trail_with_its_end(scene: PlanScene) -> None:
    operation = (await scene.put()).json()
    for _ in range(500):
        events = await audit(scene.admin, "operation.")
        if len(events) == 2:
            break
        await asyncio.sleep(0.01)
    ended, began = events
    assert (began["action"], ended["action"]) == ("operation.began", "operation.ended")
    assert began["actor_name"] == "alice"
    assert began["drone_id"] == scene.drone.id
    assert began["detail"]["operation"] == operation["id"]
    assert (began["detail"]["items"], began["detail"]["hash"]) == (2, operation["hash"])
    assert (ended["detail"]["state"], ended["detail"]["words"]) == ("done", "It is on board.")


async def test_what_the_autopilot_will_not_keep_is_told_before_anything_is_sent(scene: PlanScene) -> None:
    async def foresee(rows: list[Any], kind: str = "mission") -> httpx.Response:
        return await scene.watcher.post(f"{scene.path}/{kind}/kept", json={"items": rows})

    plain = (await foresee([ROWS[0], [20, 2, [0, 0, 0, 0], 0, 0, 0, 1]])).json()
    assert plain == {"autopilot": "ArduPilot", "changes": [], "count": 0, "quiet": 2, "zones": []}  # an open heading
    reported = (await foresee([[16, 3, [2.5, 0, 0, 0], 470001000, 80001000, 30.0, 1]])).json()
    assert reported["changes"] == [
        {
            "item": 0,
            "field": "param1",
            "sent": 2.5,
            "kept": 2.0,
            "effect": "flight",
            "words": "Item 1: ArduPilot keeps parameter 1 as 2, not 2.5.",
        }
    ]
    refused = (await foresee([[1000, 2, [0, 0, None, 0], 0, 0, 0, 1]])).json()
    assert [(one["field"], one["effect"]) for one in refused["changes"]] == [("param3", "refused")]
    look_at = [195, 3, [0, 0, 0, 0], 470001000, 80001000, 30.0, 1]
    assert (await foresee([look_at])).json()["changes"] == []
    of_4_6 = AutopilotState(heard=True, armed=False, airborne=False, firmware=0x040602FF)
    scene.world.tower.hub.reports.receive(scene.agent.link, of_4_6)
    older = (await foresee([look_at])).json()["changes"]
    assert [(one["field"], one["effect"]) for one in older] == [("command", "refused")]
    assert older[0]["words"] == "Item 1: this release of ArduPilot does not know command 195."
    seen = (await scene.watcher.get(scene.path)).json()
    assert (seen["firmware"], seen["release"]) == ("4.6.2", [4, 6])
    many = (await foresee([[5100, 3, [0, 0, 0, 0], 1, 2, 20.5, 0]] * 700, "rally")).json()
    assert (len(many["changes"]), many["count"]) == (200, 701)  # plus one for too many items
    assert_problem(await foresee([[16]]), 422, "invalid-request")
    assert scene.agent.asked == []
