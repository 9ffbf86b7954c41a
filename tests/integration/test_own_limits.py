"""What the vehicle itself would not do is refused in words before it is sent: its own fence, motors it lacks."""

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from control_world import until
from flying_scene import HOME, Scene
from tower_world import assert_problem, start_tower

from wire.dialect import mavlink
from wire.parameters import Parameter, by_name
from wire.plans import PlanItem, PlanKind

FENCE = {"FENCE_ENABLE": 1, "FENCE_TYPE": 7, "FENCE_ALT_MAX": 100, "FENCE_RADIUS": 300, "FRAME_CLASS": 1}
LAT, LON, _ = HOME
NORTH_M = 1 / 111_319.5
MOTOR = {"command": "motor_test", "throttle_percent": 5, "for_s": 1, "propellers_off": "kestrel"}


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        await scene.begin()
        scene.agent.parameters()
        scene.agent.table = by_name([Parameter(name, float(value), 9) for name, value in FENCE.items()])
        scene.agent.report_parameters()
        drone = world.tower.hub.state.drones[scene.drone.id]
        await until("the table", lambda: drone.onboard.parameters.table() is not None)
        yield scene


def fly(scene: Scene) -> None:
    scene.agent.state(armed=True, airborne=True)
    place = round(LAT * 1e7), round(LON * 1e7), 520_000, 20_000
    scene.agent.frame(mavlink.MAVLink_global_position_int_message(1, *place, 0, 0, 0, 0))


def to(north_m: float, height_m: float = 20.0) -> dict[str, object]:
    return {"command": "goto", "lat": LAT + north_m * NORTH_M, "lon": LON, "height_m": height_m}


def flown(scene: Scene) -> int:
    return sum(getattr(one.work, "command", 0) == 192 for one in scene.agent.asked)


async def test_a_place_outside_the_fence_is_refused_with_its_limit(scene: Scene) -> None:
    path = f"{scene.path}/commands"
    fly(scene)
    refused = {301: "301 m from home, and FENCE_RADIUS is 300 m"}
    for north_m, words in refused.items():
        told = assert_problem(await scene.holder.post(path, json=to(north_m)), 409, "outside-fence")["detail"]
        assert told == f"the autopilot of kestrel has a fence, and this is outside it: {words}. Nothing was sent"
    too_high = assert_problem(await scene.holder.post(path, json=to(0, 130)), 409, "outside-fence")
    assert "130 m above home, and FENCE_ALT_MAX is 100 m" in too_high["detail"]
    up = await scene.holder.post(path, json={"command": "takeoff", "height_m": 130})
    assert_problem(up, 409, "outside-fence")
    assert scene.agent.asked == [one for one in scene.agent.asked if "Parameters" in type(one.work).__name__]
    assert (await scene.holder.post(path, json=to(299))).json()["state"] == "done"
    assert flown(scene) == 1
    for command in ("land", "rtl", "hold"):
        assert (await scene.holder.post(path, json={"command": command})).json()["state"] == "done"


async def test_the_area_on_board_counts_and_a_fence_that_is_off_does_not(scene: Scene) -> None:
    path = f"{scene.path}/commands"
    fly(scene)
    ring = PlanItem(5003, 3, (80.0, 0, 0, 0), round(LAT * 1e7), round(LON * 1e7))
    scene.agent._keep(PlanKind.FENCE, (ring,))
    told = assert_problem(await scene.holder.post(path, json=to(90)), 409, "outside-fence")["detail"]
    assert "outside the area that it keeps" in told
    # DO_FENCE_ENABLE 0 leaves the parameter alone: SYS_STATUS shows it.
    nothing = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 12_000, 0, 90, 0, 0, 0, 0, 0, 0)
    scene.agent.frame(nothing)
    assert (await scene.holder.post(path, json=to(900))).json()["state"] == "done"


async def test_a_motor_that_the_frame_does_not_have(scene: Scene) -> None:
    path = f"{scene.path}/commands"
    told = assert_problem(await scene.holder.post(path, json=MOTOR | {"motor": 9}), 409, "no-such-motor")["detail"]
    assert told == "kestrel has no motor 9: its frame has 4"
    assert (await scene.holder.post(path, json=MOTOR | {"motor": 4})).json()["state"] == "done"
