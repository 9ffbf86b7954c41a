"""Settings of a drone, the check before flight, and rehearsed losses, over REST."""

import asyncio
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import ObedientAgent, ask, audit, live
from tower_world import NewDrone, Person, TowerWorld, assert_problem, start_tower

from server.control.core.loss_words import findings_hash
from server.control.store.rehearsal import LASTS_S
from server.control.store.tables import ControlLeaseRow, LossAcknowledgementRow
from server.fleet.store.snapshot import begin_fleet_change
from server.kernel.people import Role
from wire.control_messages import HoldStep, SafetySettings, StreamSettings
from wire.ids import DroneId, UserId
from wire.open_holds import LostAction
from wire.stream_profiles import StreamChoice

NOW = datetime(2026, 1, 1, tzinfo=UTC)


class Scene:
    """Anna owns the drone hawk, Bob does not; Root is an admin."""

    def __init__(
        self, world: TowerWorld, drone: NewDrone, people: list[Person], clients: list[httpx.AsyncClient]
    ) -> None:
        self.ids = {person.name: UserId(person.id) for person in people}
        self.world = world
        self.drone = drone
        self.path = f"/api/v1/drones/{drone.id}"
        self.anna, self.bob, self.root = clients
        self.agent = ObedientAgent(world.tower.hub, drone.id)

    async def acknowledge(self, client: httpx.AsyncClient, named: str | None = "hawk") -> httpx.Response:
        return await client.post(f"{self.path}/loss-check/acknowledge", json={"drone": named})


@pytest.fixture
async def scene(tmp_path: Path):
    async with start_tower(tmp_path) as world:
        yield await _scene(world)


async def _scene(world: TowerWorld) -> Scene:
    people = [await world.add_user("Anna"), await world.add_user("Bob"), await world.add_user("Root", Role.ADMIN)]
    drone = await world.add_drone("hawk", people[0])
    return Scene(world, drone, people, [await world.signed_in(person) for person in people])


async def test_settings_reach_the_agent_the_database_and_the_next_tower(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        scene = await _scene(world)
        before = (await scene.anna.get(f"{scene.path}/settings")).json()
        assert (before["hold_ladder"], before["lost_action"], before["rtt_limit_ms"]) == ([], "return", 500.0)
        change = {"hold_ladder": ["LOITER", "BRAKE"], "lost_action": "land", "lost_action_s": 12, "rtt_limit_ms": 800}
        answer = await scene.root.patch(f"{scene.path}/settings", json=change)
        assert answer.json() == {**before, **change}
        lost = {"lost_action": LostAction.LAND, "lost_action_s": 12.0}
        expected = SafetySettings(hold_ladder=("LOITER", "BRAKE"), rtt_limit_ms=800.0, **lost)
        assert scene.agent.posted[-1] == expected
        drone = (await scene.anna.get(scene.path)).json()
        assert (drone["lost_action"], drone["lost_action_s"]) == ("land", 12.0)
        (changed,) = await audit(scene.root, "drone.settings_changed")
        assert changed["detail"]["changed"]["lost_action"] == ["return", "land"]
        assert changed["drone_id"] == scene.drone.id
        await scene.root.patch(f"{scene.path}/settings", json={"sticks_stale_s": 1.0, "stream_profile": "thin"})
        assert StreamSettings(profile=StreamChoice.THIN) in scene.agent.posted
    async with start_tower(tmp_path) as world:
        anna = await world.signed_in("Anna")
        kept = (await anna.get(f"/api/v1/drones/{scene.drone.id}/settings")).json()
        assert kept == {**before, **change, "sticks_stale_s": 1.0, "stream_profile": "thin"}
        live_drone = world.tower.hub.state.drones.get(DroneId(scene.drone.id))
        assert live_drone is not None
        assert (live_drone.safety.hold_ladder, live_drone.safety.rtt_limit_ms) == (("LOITER", "BRAKE"), 800.0)
        assert live_drone.stream.profile is StreamChoice.THIN


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"hold_ladder": ["STABILIZE"]}, "hold_ladder"),
        ({"hold_ladder": ["LOITER", "LOITER"]}, "hold_ladder"),
        ({"hold_ladder": ["LOITER", "ALTCTL"]}, "hold_ladder"),
        ({"hold_ladder": ["ALT_HOLD", "LOITER"]}, "hold_ladder"),
        ({"hold_bound_s": 30}, "hold_bound_s"),
        ({"lost_action": "nothing"}, "lost_action"),
        ({"sticks_stale_s": -1}, "sticks_stale_s"),
        ({"lost_hold_s": "nan"}, "lost_hold_s"),
        ({"rtt_limit_ms": 1e9}, "rtt_limit_ms"),
        ({"lost_action": "explode"}, "lost_action"),
        ({"lost_hold_s": 10, "lost_action_s": 5}, "lost_action_s"),
        ({"stream_profile": "tiny"}, "stream_profile"),
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
    live_drone = hub.state.drones.get(DroneId(scene.drone.id))
    assert live_drone is not None
    unknown = (await scene.anna.get(path)).json()
    assert (unknown["complete"], unknown["has_radio"], unknown["dangerous"]) == (False, None, False)
    scene.agent.parameters(RC_OVERRIDE_TIME=3, FS_THR_ENABLE=1, FS_GCS_ENABLE=1, SYSID_MYGCS=255)
    harmless = (await scene.anna.get(path)).json()
    assert (harmless["complete"], harmless["has_radio"], harmless["dangerous"]) == (True, True, False)

    def waits(name: str) -> bool:
        return live_drone.loss_check.bars(scene.ids[name])

    assert not waits("Anna")

    scene.agent.parameters(has_radio=False, RC_OVERRIDE_TIME=3, FS_THR_ENABLE=0, FS_GCS_ENABLE=1)
    assert (await scene.anna.get(path)).json()["dangerous"]
    assert waits("Anna")
    assert_problem(await scene.acknowledge(scene.anna), 409, "not-the-holder")
    assert_problem(await scene.acknowledge(scene.bob), 404, "unknown-drone")
    await ask(scene.anna, scene.drone.id, "acquire")
    assert waits("Anna")
    for named in ("falcon", "Hawk", None):
        assert_problem(await scene.acknowledge(scene.anna, named), 409, "wrong-name")
    assert_problem(await scene.anna.post(f"{path}/acknowledge"), 409, "wrong-name")
    assert waits("Anna")
    read = (await scene.acknowledge(scene.anna)).json()
    assert (read["dangerous"], read["acknowledged"]) == (True, True)
    assert not waits("Anna")
    (noted,) = await audit(scene.root, "drone.loss_check_acknowledged")
    assert noted["actor_name"] == "Anna"
    assert any("FS_THR_ENABLE is 0" in text for text in noted["detail"]["dangers"])

    # Each holder has to read it once, and again only when it changes.
    await ask(scene.root, scene.drone.id, "take")
    assert waits("Root")
    assert not (await scene.root.get(path)).json()["acknowledged"]
    await ask(scene.root, scene.drone.id, "give")
    await ask(scene.anna, scene.drone.id, "accept", sticks_centred=True)
    assert not waits("Anna")
    scene.agent.parameters(has_radio=False, RC_OVERRIDE_TIME=-1, FS_THR_ENABLE=0, FS_GCS_ENABLE=1)
    assert waits("Anna")
    assert not (await scene.anna.get(path)).json()["acknowledged"]


async def test_an_assistant_acknowledges_for_themselves(scene: Scene) -> None:
    path = f"{scene.path}/loss-check"
    scene.agent.parameters(RC_OVERRIDE_TIME=-1)
    await ask(scene.anna, scene.drone.id, "acquire")
    assert_problem(await scene.acknowledge(scene.root), 409, "not-the-holder")
    await ask(scene.root, scene.drone.id, "assist")
    assert not (await scene.root.get(path)).json()["acknowledged"]
    assert (await scene.acknowledge(scene.root)).json()["acknowledged"]
    assert (await scene.root.get(path)).json()["acknowledged"]
    assert not (await scene.anna.get(path)).json()["acknowledged"], "the holder has not read it"
    await scene.acknowledge(scene.anna)
    # A user who may not arm still sees whether the holder has read it.
    await ask(scene.root, scene.drone.id, "unassist")
    assert (await scene.root.get(path)).json()["acknowledged"]


async def test_a_changed_check_is_told_on_the_live_channel(scene: Scene) -> None:
    async with live(scene.world, scene.anna) as screen:
        scene.agent.parameters(RC_OVERRIDE_TIME=-1)
        await screen.event("loss_check", drone_id=scene.drone.id)
        await ask(scene.anna, scene.drone.id, "acquire")
        await screen.event("loss_check", drone_id=scene.drone.id)
        await scene.acknowledge(scene.anna)
        await screen.event("loss_check", drone_id=scene.drone.id)
        await scene.root.patch(f"{scene.path}/settings", json={"sticks_stale_s": 1.0})
        await screen.event("loss_check", drone_id=scene.drone.id)


async def test_what_was_acknowledged_in_another_process_counts_when_the_controls_move_there(scene: Scene) -> None:
    world, drone_id, anna = scene.world, DroneId(scene.drone.id), scene.ids["Anna"]
    scene.agent.parameters(RC_OVERRIDE_TIME=-1)
    live_drone = world.tower.hub.state.drones.get(drone_id)
    assert live_drone is not None
    assert live_drone.loss_check.bars(anna)
    known = findings_hash(world.tower.loss_checks.check(drone_id).sentences)
    async with world.database.writing() as session:
        await begin_fleet_change(session)
        session.add(
            ControlLeaseRow(drone_id=drone_id, holder_id=anna, operator_holder_id=anna, epoch=5, changed_at=NOW)
        )
        session.add(LossAcknowledgementRow(drone_id=drone_id, user_id=anna, findings_hash=known, acknowledged_at=NOW))
    await world.tower.roster.refresh()
    await world.tower.event_handler.caught_up()
    assert not live_drone.loss_check.bars(anna)


async def test_an_acknowledgement_outlives_the_tower(tmp_path: Path) -> None:
    dangerous = {"RC_OVERRIDE_TIME": -1.0}
    async with start_tower(tmp_path) as world:
        scene = await _scene(world)
        scene.agent.parameters(**dangerous)
        await ask(scene.anna, scene.drone.id, "acquire")
        for _ in range(2):
            assert (await scene.acknowledge(scene.anna)).json()["acknowledged"]
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
        assert (await screen.event("rehearsal", phase="begun"))["lasts_s"] == LASTS_S["operator"]
        if step is HoldStep.NOT_NEEDED:
            unneeded = await screen.event("rehearsal", phase="not_needed")
            assert (unneeded["hold_ms"], "disarmed" in unneeded["text"]) == (None, True)
        elif step is HoldStep.UNCONFIRMED:
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


@pytest.mark.parametrize(
    ("armed", "by_hand", "phase", "words"),
    [
        (False, False, "not_needed", "on the ground, disarmed"),
        (True, False, "not_needed", "nobody flies it by hand"),
        (True, True, "failed", "did not hold"),
    ],
)
async def test_losing_the_tower_where_no_hold_comes(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, armed: bool, by_hand: bool, phase: str, words: str
) -> None:
    scene.agent.state(armed=armed)
    live_drone = scene.world.tower.hub.state.drones.get(DroneId(scene.drone.id))
    assert live_drone is not None
    if by_hand:
        live_drone.sticks_at = time.monotonic() + 60.0  # keeps the sticks fresh, however long the request takes
    rehearsals, asked = scene.world.tower.rehearsals, asyncio.Event()
    outcome = rehearsals._outcome

    async def outcome_when_asked(*rehearsal: Any) -> Any:
        await asked.wait()
        return await outcome(*rehearsal)

    monkeypatch.setattr(rehearsals, "_outcome", outcome_when_asked)
    monkeypatch.setattr(rehearsals, "_given_up_after_s", 0.1)
    monkeypatch.setitem(LASTS_S, "tower", 0.05)
    wanted = {"what": "tower", "in_flight": armed}
    async with live(scene.world, scene.root) as screen:
        await scene.root.post(f"{scene.path}/rehearsal", json=wanted)
        assert (await scene.root.get(f"{scene.path}/rehearsal")).json()["running"]
        asked.set()
        reported = await screen.event("rehearsal", phase=phase)
        assert (words in reported["text"], reported["hold_ms"]) == (True, None)
        await screen.event("rehearsal", phase="ended")
    # It is over, so another one may begin.
    assert (await scene.root.post(f"{scene.path}/rehearsal", json=wanted)).status_code == 202


async def test_what_a_rehearsal_would_be(scene: Scene) -> None:
    path = f"{scene.path}/rehearsal"
    assert_problem(await scene.bob.get(path), 404, "unknown-drone")
    assert (await scene.anna.get(path)).json() == {
        "lasts_s": {"operator": LASTS_S["operator"], "tower": LASTS_S["tower"]},
        "running": False,
        "simulated": False,
    }
    scene.agent.parameters(SIM_SPEEDUP=1)
    assert (await scene.anna.get(path)).json()["simulated"]
    assert (await scene.anna.get(f"{scene.path}/loss-check")).json()["simulated"]


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
    answer = await scene.anna.post(f"{scene.path}/rehearsal", json=wanted)
    assert answer.status_code == 202, answer.text


async def test_a_simulator_is_rehearsed_in_flight(scene: Scene) -> None:
    scene.agent.state(armed=True, airborne=True)
    scene.agent.parameters(SIM_SPEEDUP=1)
    acquired = await ask(scene.anna, scene.drone.id, "acquire")
    assert acquired.status_code == 200, acquired.text
    answer = await scene.anna.post(f"{scene.path}/rehearsal", json={"what": "operator"})
    assert answer.status_code == 202, answer.text
