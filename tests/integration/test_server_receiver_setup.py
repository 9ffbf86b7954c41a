"""Set-up for a failure of the computer on board, with and without a radio receiver, over REST: what is shown, what is
written, and when it is refused."""

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from flying_scene import Scene
from tower_world import assert_problem, start_tower

from wire.control_messages import AutopilotState
from wire.transactions import ParametersWriteWork

AS_IT_COMES = {"FS_THR_ENABLE": 1.0, "FS_OPTIONS": 16.0, "RC_OVERRIDE_TIME": 3.0}


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        await scene.begin()
        scene.agent.parameters(has_radio=False, **AS_IT_COMES)
        yield scene


async def test_what_is_not_as_it_should_be_is_shown_and_written(scene: Scene) -> None:
    path = f"{scene.path}/receiver-setup"
    shown = (await scene.watcher.get(path)).json()
    assert (shown["autopilot"], shown["has_radio"], shown["needed"], shown["known"]) == ("ardupilot", False, True, True)
    assert [(row["name"], row["now"], row["wanted"], row["ok"]) for row in shown["rows"]] == [
        ("FS_THR_ENABLE", 1.0, 1.0, True),
        ("FS_OPTIONS", 16.0, 29.0, False),
        ("RC_OVERRIDE_TIME", 3.0, 3.0, True),
    ]
    begun = await scene.holder.post(path)
    assert begun.status_code == 202, begun.text
    assert (begun.json()["work"], begun.json()["state"]) == ("parameters_write", "running")
    written = [one.work for one in scene.agent.asked if isinstance(one.work, ParametersWriteWork)]
    assert [work.values for work in written] == [(("FS_OPTIONS", 29.0),)]
    scene.agent.parameters(has_radio=False, **AS_IT_COMES | {"FS_OPTIONS": 29.0})
    assert not (await scene.watcher.get(path)).json()["needed"]
    assert_problem(await scene.holder.post(path), 409, "nothing-to-set")


async def test_with_a_receiver_other_parameters_are_written(scene: Scene) -> None:
    path = f"{scene.path}/receiver-setup"
    station = {"FS_GCS_ENABLE": 0.0, "FS_GCS_TIMEOUT": 5.0}
    scene.agent.parameters(has_radio=True, **AS_IT_COMES | station)
    check = (await scene.holder.get(f"{scene.path}/loss-check")).json()
    assert check["dangerous"]
    assert (await scene.watcher.get(path)).json()["needed"]
    assert (await scene.holder.post(path)).status_code == 202
    (written,) = [one.work for one in scene.agent.asked if isinstance(one.work, ParametersWriteWork)]
    assert written.values == (("FS_GCS_ENABLE", 1.0), ("FS_OPTIONS", 2.0))
    scene.agent.parameters(has_radio=True, **AS_IT_COMES | station | dict(written.values))
    assert not (await scene.holder.get(f"{scene.path}/loss-check")).json()["dangerous"]
    assert not (await scene.watcher.get(path)).json()["needed"]
    assert_problem(await scene.holder.post(path), 409, "nothing-to-set")


async def test_it_is_for_whoever_has_the_controls_and_no_borrower(scene: Scene) -> None:
    path = f"{scene.path}/receiver-setup"
    for client in (scene.watcher, scene.admin):
        assert_problem(await client.post(path), 409, "not-in-control")
    stranger = await scene.world.signed_in(await scene.world.add_user("mallory"))
    for answer in (await stranger.get(path), await stranger.post(path)):
        assert_problem(answer, 404, "unknown-drone")
    carol = await scene.lend_to_carol()
    assert_problem(await carol.post(path), 409, "loan")
    assert scene.agent.asked == []


async def test_it_is_for_the_ground_and_unknown_is_not_the_ground(scene: Scene) -> None:
    path = f"{scene.path}/receiver-setup"
    scene.agent.state(armed=True)
    assert_problem(await scene.holder.post(path), 409, "armed")
    silent = AutopilotState(heard=False, armed=False, airborne=False)
    scene.world.tower.hub.reports.receive(scene.agent.link, silent)
    assert_problem(await scene.holder.post(path), 409, "not-known-yet")
    assert_problem(
        await scene.holder.post(f"{scene.path}/commands", json={"command": "takeoff", "height_m": 5}),
        409,
        "not-known-yet",
    )
    disarm = await scene.holder.post(f"{scene.path}/commands", json={"command": "disarm"})
    assert "may be in the air" in assert_problem(disarm, 409, "would-fall")["detail"]
    scene.agent.state()
    scene.agent.parameters(has_radio=False, FS_THR_ENABLE=1.0)
    assert_problem(await scene.holder.post(path), 409, "not-known-yet")
    scene.agent.parameters(has_radio=None, **AS_IT_COMES)
    assert_problem(await scene.holder.post(path), 409, "not-known-yet")
    assert scene.agent.asked == []
