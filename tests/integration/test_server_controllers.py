"""Controllers on board over REST: who may start and stop one, what reaches the agent, what an old one is spared."""

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from flying_scene import Scene
from tower_world import assert_problem, start_tower

from server.link.core.agent_link import AgentLink
from wire.controller_settings import ControllerDescribed, ControllerSetting, SettingKind
from wire.controllers import CONTROLLERS, ControllerWork, offers
from wire.ids import DroneId
from wire.transactions import TransactionProgress


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        await scene.begin()
        link: Any = scene.agent.link
        assert isinstance(link, AgentLink)
        link.takes = frozenset({*link.takes, CONTROLLERS})
        scene.agent.waits = True
        yield scene


async def start(scene: Scene, client: Any = None, **body: Any) -> Any:
    return await (client or scene.holder).post(f"{scene.path}/controller", json={"controller": "survey"} | body)


async def test_the_holder_starts_one_with_limits_sees_it_and_stops_it(scene: Scene) -> None:
    begun = await start(scene, max_speed_m_s=3, max_height_m=12, for_s=60)
    assert begun.status_code == 202, begun.text
    assert (begun.json()["work"], begun.json()["state"]) == ("controller", "running")
    (asked,) = scene.agent.asked
    assert asked.work == ControllerWork("survey", max_speed_m_s=3.0, max_height_m=12.0)
    assert asked.deadline_s == 60.0
    scene.agent.announce(TransactionProgress(id=asked.id, phase="survey, flying: 20.0 set-points/s", done=1, total=60))
    shown = await scene.watcher.get(f"{scene.path}/controller")
    assert (shown.json()["id"], shown.json()["phase"]) == (begun.json()["id"], "survey, flying: 20.0 set-points/s")
    assert_problem(await start(scene), 409, "drone-busy")
    assert_problem(await scene.watcher.delete(f"{scene.path}/controller"), 409, "not-in-control")
    stopped = await scene.holder.delete(f"{scene.path}/controller")
    assert stopped.status_code == 202, stopped.text
    assert scene.agent.cancelled[0] == asked.id


async def test_nobody_else_starts_one_and_no_borrower_with_limits(scene: Scene) -> None:
    for client in (scene.watcher, scene.admin):
        assert_problem(await start(scene, client), 409, "not-in-control")
    carol = await scene.lend_to_carol(max_height_m=50)
    assert_problem(await start(scene, carol), 409, "loan")
    assert scene.agent.asked == []
    assert_problem(await scene.holder.get(f"{scene.path}/controller"), 404, "unknown-operation")
    assert_problem(await scene.admin.delete(f"{scene.path}/controller"), 404, "unknown-operation")


async def test_an_agent_that_does_not_know_controllers_is_sent_none(scene: Scene) -> None:
    link: Any = scene.agent.link
    link.takes = link.takes - {CONTROLLERS}
    assert_problem(await start(scene), 409, "agent-too-old")
    assert scene.agent.asked == []


async def test_whoever_watches_sees_what_the_agent_has_and_what_runs(scene: Scene) -> None:
    path = f"{scene.path}/controller/choices"
    link: Any = scene.agent.link
    link.takes = frozenset({*link.takes, *offers(["survey", "scripted"])})
    controllers = [{"name": name, "settings": None} for name in ("scripted", "survey")]
    named = {"offered": True, "names": ["scripted", "survey"], "controllers": controllers, "running": None}
    assert (await scene.watcher.get(path)).json() == named
    begun = (await start(scene)).json()
    assert (await scene.watcher.get(path)).json()["running"]["id"] == begun["id"]
    link.takes = frozenset()
    shown = (await scene.watcher.get(path)).json()
    assert (shown["offered"], shown["names"]) == (False, [])
    stranger = await scene.world.signed_in(await scene.world.add_user("carol"))
    assert_problem(await stranger.get(path), 404, "unknown-drone")


HEIGHT = ControllerSetting(
    name="height_m", kind=SettingKind.NUMBER, default=10.0, label="Height", unit="m", least=2.0, most=60.0
)


async def test_a_described_setting_is_shown_and_checked_before_the_start(scene: Scene) -> None:
    link: Any = scene.agent.link
    link.takes = frozenset({*link.takes, *offers(["survey"])})
    scene.agent.announce(ControllerDescribed(controller="survey", settings=(HEIGHT,)))
    choices = (await scene.watcher.get(f"{scene.path}/controller/choices")).json()
    ((shown,),) = [one["settings"] for one in choices["controllers"]]
    assert (shown["name"], shown["kind"], shown["unit"], shown["default"]) == ("height_m", "number", "m", 10.0)
    assert (shown["least"], shown["most"], shown["is_rare"]) == (2.0, 60.0, False)
    for settings, name in (
        ({"height_m": 99}, "height_m"),
        ({"heigth_m": 9}, "heigth_m"),
        ({"height_m": "x"}, "height_m"),
    ):
        refused = await start(scene, settings=settings)
        assert_problem(refused, 422, "invalid-request")
        assert [one["field"] for one in refused.json()["errors"]] == [f"settings.{name}"]
    assert scene.agent.asked == []
    assert (await start(scene, settings={"height_m": 12})).status_code == 202


async def test_what_a_controller_was_is_forgotten_with_its_link(scene: Scene) -> None:
    scene.agent.announce(ControllerDescribed(controller="survey", settings=()))
    assert (await start(scene, settings={"height_m": 12})).status_code == 422
    drone = scene.world.tower.hub.state.drones[DroneId(scene.drone.id)]
    drone.forget_link(scene.world.clock())
    assert drone.onboard.controllers.of("survey") is None


@pytest.mark.parametrize(
    "body", [{"controller": "/etc/x.py"}, {"max_speed_m_s": 99}, {"max_height_m": -1}, {"for_s": 9999}, {"other": 1}]
)
async def test_what_is_no_request(scene: Scene, body: dict[str, Any]) -> None:
    assert (await start(scene, **body)).status_code == 422
    assert scene.agent.asked == []


async def test_nobody_arms_by_it_before_the_loss_check_is_read(scene: Scene) -> None:
    scene.agent.parameters(FS_THR_ENABLE=0, FS_GCS_ENABLE=0, has_radio=False)
    assert_problem(await start(scene, may_take_off=True), 409, "loss-check")
    assert scene.agent.asked == []
    assert (await start(scene)).status_code == 202
