"""Set-up of a vehicle over REST: on the ground and disarmed, by its pilot, with propellers confirmed, and audited."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from flying_scene import Scene
from tower_world import assert_problem, start_tower

from wire.control_messages import AutopilotState
from wire.transactions import CommandWork

MOTOR = {"command": "motor_test", "motor": 2, "throttle_percent": 5, "for_s": 1, "propellers_off": "kestrel"}
ALL = (
    {"command": "calibrate", "sensor": "compass"},
    {"command": "calibration_pose", "pose": 1},
    {"command": "calibration_end", "keep": True},
    {"command": "reboot"},
    MOTOR,
)


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        await scene.begin()
        scene.agent.state()
        yield scene


async def test_each_becomes_a_command_of_the_autopilot(scene: Scene) -> None:
    path = f"{scene.path}/commands"
    for body in ALL:
        answer = await scene.holder.post(path, json=body)
        assert answer.json()["state"] == "done", answer.text
    works = [one.work for one in scene.agent.asked if isinstance(one.work, CommandWork)]
    assert [work.command for work in works] == [42424, 42429, 42425, 246, 209]
    assert works[-1].params == (2.0, 0.0, 5.0, 1.0, 1.0, 0.0, 0.0)
    for _ in range(1500):  # the trail is written after the answer
        if await commands_in_the_trail(scene) == {body["command"] for body in ALL}:
            return
        await asyncio.sleep(0.02)
    raise AssertionError("the trail does not have every command")


async def commands_in_the_trail(scene: Scene) -> set[str]:
    rows = (await scene.admin.get("/api/v1/audit?action=command.given")).json()
    return {row["detail"]["command"] for row in rows}


async def test_never_in_the_air_nor_armed_nor_where_that_is_not_known(scene: Scene) -> None:
    path, hub = f"{scene.path}/commands", scene.world.tower.hub
    for armed, airborne, heard in ((True, False, True), (True, True, True), (False, False, False)):
        state = AutopilotState(heard=heard, armed=armed, airborne=airborne)
        hub.reports.receive(scene.agent.link, state)
        for body in ALL:
            told = assert_problem(await scene.holder.post(path, json=body), 409, "not-on-the-ground")["detail"]
            assert ("it is not known whether kestrel is armed" in told) is not heard
    assert scene.agent.asked == []


async def test_motors_need_the_name_and_a_borrower_sets_up_nothing(scene: Scene) -> None:
    path = f"{scene.path}/commands"
    wrong = await scene.holder.post(path, json=MOTOR | {"propellers_off": "merlin"})
    assert "propellers of kestrel" in assert_problem(wrong, 409, "propellers-not-confirmed")["detail"]
    for limit in ({"throttle_percent": 31}, {"for_s": 6}, {"motor": 0}, {"motor": 13}):
        assert (await scene.holder.post(path, json=MOTOR | limit)).status_code == 422
    assert_problem(await scene.watcher.post(path, json=MOTOR), 409, "not-in-control")
    carol = await scene.lend_to_carol(may_arm=True)
    for body in ALL:
        assert_problem(await carol.post(path, json=body), 409, "loan")
    assert scene.agent.asked == []
