"""Settings of a drone, the check before flight, and losses made on purpose, over REST."""

from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import ObedientAgent, ask, audit, live
from tower_world import NewDrone, TowerWorld, assert_problem, start_tower

from server.accounts.tables import Role
from server.control.rehearsal import LASTS_S
from wire.control_messages import HoldStep, LostAction, SafetySettings
from wire.ids import DroneId


class Scene:
    """Anna owns the drone hawk, Bob does not; Root is an admin."""

    def __init__(self, world: TowerWorld, drone: NewDrone, clients: list[httpx.AsyncClient]) -> None:
        self.world = world
        self.drone = drone
        self.path = f"/api/v1/drones/{drone.id}"
        self.anna, self.bob, self.root = clients
        self.agent = ObedientAgent(world.tower.hub, drone.id)


@pytest.fixture
async def scene(tmp_path: Path):
    async with start_tower(tmp_path) as world:
        yield await _scene(world)


async def _scene(world: TowerWorld) -> Scene:
    anna = await world.add_user("Anna")
    await world.add_user("Bob")
    await world.add_user("Root", Role.ADMIN)
    drone = await world.add_drone("hawk", anna)
    return Scene(world, drone, [await world.signed_in(name) for name in ("Anna", "Bob", "Root")])


async def test_settings_reach_the_agent_the_database_and_the_next_tower(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        scene = await _scene(world)
        before = (await scene.anna.get(f"{scene.path}/settings")).json()
        assert (before["hold_ladder"], before["lost_action"], before["rtt_limit_ms"]) == ([], "return", 500.0)
        change = {"hold_ladder": ["LOITER", "BRAKE"], "lost_action": "land", "lost_action_s": 12, "rtt_limit_ms": 800}
        answer = await scene.root.patch(f"{scene.path}/settings", json=change)
        assert answer.json() == {**before, **change}
        expected = SafetySettings(hold_ladder=("LOITER", "BRAKE"), lost_action=LostAction.LAND, lost_action_s=12.0)
        assert scene.agent.posted[-1] == expected
        drone = (await scene.anna.get(scene.path)).json()
        assert (drone["lost_action"], drone["lost_action_s"]) == ("land", 12.0)
        (changed,) = await audit(scene.root, "drone.settings_changed")
        assert changed["detail"]["changed"]["lost_action"] == ["return", "land"]
        assert changed["drone_id"] == scene.drone.id
        await scene.root.patch(f"{scene.path}/settings", json={"sticks_stale_s": 1.0})
    async with start_tower(tmp_path) as world:
        anna = await world.signed_in("Anna")
        kept = (await anna.get(f"/api/v1/drones/{scene.drone.id}/settings")).json()
        assert kept == {**before, **change, "sticks_stale_s": 1.0}
        live_drone = world.tower.hub.drone(DroneId(scene.drone.id))
        assert live_drone is not None
        assert (live_drone.safety.hold_ladder, live_drone.rtt_limit_ms) == (("LOITER", "BRAKE"), 800.0)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"hold_ladder": ["STABILIZE"]}, "hold_ladder"),
        ({"hold_ladder": ["LOITER", "LOITER"]}, "hold_ladder"),
        ({"hold_ladder": ["LOITER", "ALTCTL"]}, "hold_ladder"),
        ({"hold_ladder": ["ALT_HOLD", "LOITER"]}, "hold_ladder"),
        ({"hold_bound_s": 0}, "hold_bound_s"),
        ({"sticks_stale_s": -1}, "sticks_stale_s"),
        ({"lost_hold_s": "nan"}, "lost_hold_s"),
        ({"rtt_limit_ms": 1e9}, "rtt_limit_ms"),
        ({"lost_action": "explode"}, "lost_action"),
        ({"lost_hold_s": 10, "lost_action_s": 5}, "lost_action_s"),
        ({"surprise": 1}, "surprise"),
    ],
)
async def test_settings_that_make_no_sense_change_nothing(scene: Scene, change: dict[str, Any], field: str) -> None:
    before = (await scene.root.get(f"{scene.path}/settings")).json()
    answer = await scene.root.patch(f"{scene.path}/settings", json=change)
    document = assert_problem(answer, 422, "invalid-request")
    assert [error["field"] for error in document["errors"]] == [field]
    assert (await scene.root.get(f"{scene.path}/settings")).json() == before


async def test_settings_are_seen_by_the_squad_and_changed_by_admins(scene: Scene) -> None:
    assert_problem(await scene.bob.get(f"{scene.path}/settings"), 404, "unknown-drone")
    assert_problem(await scene.anna.patch(f"{scene.path}/settings", json={"rtt_limit_s": 2}), 403, "admins-only")
    gone = await scene.root.patch("/api/v1/drones/77/settings", json={"rtt_limit_s": 2})
    assert_problem(gone, 404, "unknown-drone")


async def test_a_danger_is_acknowledged_by_the_holder_and_a_new_one_anew(scene: Scene) -> None:
    path, hub = f"{scene.path}/loss-check", scene.world.tower.hub
    live_drone = hub.drone(DroneId(scene.drone.id))
    assert live_drone is not None
    unknown = (await scene.anna.get(path)).json()
    assert (unknown["complete"], unknown["has_radio"], unknown["dangerous"]) == (False, None, False)
    scene.agent.parameters(RC_OVERRIDE_TIME=3, FS_THR_ENABLE=1, FS_GCS_ENABLE=1, SYSID_MYGCS=255)
    harmless = (await scene.anna.get(path)).json()
    assert (harmless["complete"], harmless["has_radio"], harmless["dangerous"]) == (True, True, False)
    assert not live_drone.loss_check_open

    scene.agent.parameters(has_radio=False, RC_OVERRIDE_TIME=3, FS_THR_ENABLE=0, FS_GCS_ENABLE=1)
    assert (await scene.anna.get(path)).json()["dangerous"]
    assert live_drone.loss_check_open
    assert_problem(await scene.anna.post(f"{path}/acknowledge"), 409, "not-the-holder")
    assert_problem(await scene.bob.post(f"{path}/acknowledge"), 404, "unknown-drone")
    await ask(scene.anna, scene.drone.id, "acquire")
    assert live_drone.loss_check_open
    read = (await scene.anna.post(f"{path}/acknowledge")).json()
    assert (read["dangerous"], read["acknowledged"]) == (True, True)
    assert not live_drone.loss_check_open
    (noted,) = await audit(scene.root, "drone.loss_check_acknowledged")
    assert noted["actor_name"] == "Anna"
    assert any("FS_THR_ENABLE is 0" in text for text in noted["detail"]["dangers"])

    # Another holder has not read it; who has read it need not again, until there is something new.
    await ask(scene.root, scene.drone.id, "take")
    assert live_drone.loss_check_open
    await ask(scene.root, scene.drone.id, "give")
    await ask(scene.anna, scene.drone.id, "accept", sticks_centred=True)
    assert not live_drone.loss_check_open
    scene.agent.parameters(has_radio=False, RC_OVERRIDE_TIME=-1, FS_THR_ENABLE=0, FS_GCS_ENABLE=1)
    assert live_drone.loss_check_open
    assert not (await scene.anna.get(path)).json()["acknowledged"]


async def test_an_acknowledgement_outlives_the_tower(tmp_path: Path) -> None:
    dangerous = {"RC_OVERRIDE_TIME": -1.0}
    async with start_tower(tmp_path) as world:
        scene = await _scene(world)
        scene.agent.parameters(**dangerous)
        await ask(scene.anna, scene.drone.id, "acquire")
        for _ in range(2):
            assert (await scene.anna.post(f"{scene.path}/loss-check/acknowledge")).json()["acknowledged"]
    async with start_tower(tmp_path) as world:
        ObedientAgent(world.tower.hub, scene.drone.id).parameters(**dangerous)
        anna = await world.signed_in("Anna")
        assert (await anna.get(f"{scene.path}/loss-check")).json()["acknowledged"]


@pytest.mark.parametrize("step", [HoldStep.CONFIRMED, HoldStep.NOT_NEEDED, HoldStep.UNCONFIRMED])
async def test_losing_the_operator_on_purpose(scene: Scene, step: HoldStep) -> None:
    scene.agent.state()
    scene.agent.answer = step
    await ask(scene.anna, scene.drone.id, "acquire")
    async with live(scene.world, scene.anna) as screen:
        begun = await scene.anna.post(f"{scene.path}/rehearsal", json={"what": "operator"})
        assert (begun.status_code, begun.json()) == (202, {"what": "operator", "phase": "begun"})
        twice = await scene.root.post(f"{scene.path}/rehearsal", json={"what": "tower"})
        assert_problem(twice, 409, "rehearsal-running")
        await screen.event("rehearsal", phase="begun")
        if step is HoldStep.UNCONFIRMED:
            failed = await screen.event("rehearsal", phase="failed")
            assert (failed["hold_ms"], "not confirmed" in failed["text"]) == (None, True)
        else:
            held = await screen.event("rehearsal", phase="held")
            assert 1900 < held["hold_ms"] < 5000
        await screen.event("rehearsal", phase="ended")
    assert len(scene.agent.holds) == 1
    assert (await scene.anna.get(scene.path)).json()["holder"]["name"] == "Anna"
    (noted,) = await audit(scene.root, "drone.loss_rehearsed")
    assert (noted["detail"]["what"], noted["detail"]["result"]) == ("operator", step.value)


async def test_losing_the_tower_where_nobody_flies_shows_nothing_and_says_so(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene.agent.state()
    rehearsals = scene.world.tower.rehearsals
    monkeypatch.setattr(rehearsals, "_given_up_after_s", 0.05)
    monkeypatch.setitem(LASTS_S, "tower", 0.1)
    async with live(scene.world, scene.root) as screen:
        await scene.root.post(f"{scene.path}/rehearsal", json={"what": "tower"})
        failed = await screen.event("rehearsal", phase="failed")
        assert "did not hold" in failed["text"]
        await screen.event("rehearsal", phase="ended")
    # It is over: another one may begin.
    assert (await scene.root.post(f"{scene.path}/rehearsal", json={"what": "tower"})).status_code == 202


async def test_who_may_rehearse_and_when(scene: Scene) -> None:
    async def refused(client: httpx.AsyncClient, status: int, code: str, what: str = "operator") -> None:
        answer = await client.post(f"{scene.path}/rehearsal", json={"what": what})
        assert_problem(answer, status, code)

    await refused(scene.bob, 404, "unknown-drone")
    await refused(scene.anna, 409, "not-the-holder")
    await refused(scene.root, 409, "offline")
    scene.agent.state()
    await refused(scene.root, 409, "no-holder")
    await ask(scene.anna, scene.drone.id, "acquire")
    scene.agent.state(armed=True, airborne=True)
    await refused(scene.anna, 409, "in-flight")
    await refused(scene.anna, 422, "invalid-request", what="radio")
    wanted = {"what": "operator", "in_flight": True}
    assert (await scene.anna.post(f"{scene.path}/rehearsal", json=wanted)).status_code == 202


async def test_a_simulator_is_rehearsed_in_flight(scene: Scene) -> None:
    scene.agent.state(armed=True, airborne=True)
    scene.agent.parameters(SIM_SPEEDUP=1)
    await ask(scene.anna, scene.drone.id, "acquire")
    answer = await scene.anna.post(f"{scene.path}/rehearsal", json={"what": "operator"})
    assert answer.status_code == 202
