"""Commands over REST: who may give which, how sequences of steps continue and stop, and their final messages."""

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import live
from flying_scene import Scene
from tower_world import assert_problem, start_tower

from server.kernel.shares import ShareName
from server.link.core import flood_gate
from wire.dialect import mavlink
from wire.ids import DroneId
from wire.transactions import CommandWork, Outcome, Transaction


class CommandScene(Scene):
    async def order(self, client: httpx.AsyncClient | None = None, **body: Any) -> httpx.Response:
        return await (client or self.holder).post(f"{self.path}/commands", json=body)

    @property
    def sent(self) -> list[int]:
        return [one.work.command for one in self.agent.asked if isinstance(one.work, CommandWork)]


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[CommandScene]:
    async with start_tower(tmp_path) as world:
        scene = CommandScene(world)
        await scene.begin()
        yield scene


async def test_a_take_off_goes_step_by_step_and_everybody_sees_which(scene: CommandScene) -> None:
    async with live(scene.world, scene.watcher) as watching:
        done = (await scene.order(command="takeoff", height_m=20)).json()
        assert (done["work"], done["state"]) == ("command", "done")
        assert done["words"] == "kestrel accepted, now climbing to 20 m."
        reported = await watching.event("operation")
        while reported["operation"]["state"] == "running":
            reported = await watching.event("operation")
        assert reported["operation"] == done
    assert scene.sent == [176, 400, 22]
    assert {one.epoch for one in scene.agent.asked} == {1}


async def test_it_stops_at_the_first_step_that_is_not_accepted(scene: CommandScene) -> None:
    said = "PreArm: " + "Battery 1 below minimum arming voltage. " * 14

    def answer(asked: Transaction) -> dict[str, Any]:
        arming = isinstance(asked.work, CommandWork) and asked.work.command == 400
        return {"outcome": Outcome.FAILED, "words": said, "code": "MAV_RESULT_FAILED"} if arming else {}

    scene.agent.answer_with = answer
    async with live(scene.world, scene.watcher) as watching:
        failed = (await scene.order(command="takeoff", height_m=20)).json()
        assert (failed["state"], failed["code"]) == ("failed", "MAV_RESULT_FAILED")
        assert failed["words"] == f"kestrel, arming: {said}", "the autopilot's own words, and all of them"
        reported = await watching.event("operation")
        while reported["operation"]["state"] == "running":
            reported = await watching.event("operation")
        assert reported["operation"] == failed
    assert scene.sent == [176, 400]


async def test_who_may_command_is_who_has_the_controls(scene: CommandScene) -> None:
    for client in (scene.watcher, scene.admin):
        assert_problem(await scene.order(client, command="land"), 409, "not-in-control")
    stranger = await scene.world.signed_in(await scene.world.add_user("mallory"))
    assert_problem(await scene.order(stranger, command="land"), 404, "unknown-drone")
    assert scene.sent == []


async def test_what_makes_it_fall_must_be_said_so(scene: CommandScene) -> None:
    scene.agent.state(armed=True, airborne=True)
    assert_problem(await scene.order(command="disarm"), 409, "would-fall")
    assert scene.sent == []
    assert (await scene.order(command="disarm", force=True)).json()["state"] == "done"


async def test_nobody_arms_before_the_loss_check_is_read_by_no_way(scene: CommandScene) -> None:
    scene.agent.parameters(FS_THR_ENABLE=0, FS_GCS_ENABLE=0, has_radio=False)
    for body in ({"command": "arm"}, {"command": "takeoff", "height_m": 5}, {"command": "start"}):
        assert_problem(await scene.order(**body), 409, "loss-check")
    read = await scene.holder.post(f"{scene.path}/loss-check/acknowledge", json={"drone": "kestrel"})
    assert read.status_code == 200, read.text
    assert (await scene.order(command="arm")).json()["state"] == "done"


async def test_a_borrower_keeps_the_limits_of_the_loan(scene: CommandScene) -> None:
    carol = await scene.lend_to_carol(max_height_m=50, radius_m=200, may_arm=False)
    scene.agent.state(armed=True, airborne=True)
    near = {"lat": 47.001, "lon": 8.0}
    assert (await scene.order(carol, command="goto", **near, height_m=40)).json()["state"] == "done"
    refused = (
        {"command": "goto", **near, "height_m": 51},
        {"command": "goto", "lat": 47.01, "lon": 8.0, "height_m": 40},
        {"command": "set_home", **near, "altitude_m": 400, "while_flying": True},
    )
    for body in refused:
        assert_problem(await scene.order(carol, **body), 409, "loan")
    scene.agent.state()
    assert_problem(await scene.order(carol, command="takeoff", height_m=10), 409, "loan")
    assert scene.sent == [192]


async def test_home_is_moved_in_the_air_by_who_says_so_and_keeps_its_height(scene: CommandScene) -> None:
    here = {"command": "set_home", "here": True}
    assert (await scene.order(**here)).json()["state"] == "done"
    scene.agent.state(armed=True, airborne=True)
    assert_problem(await scene.order(**here, while_flying=True), 409, "not-known-yet")
    scene.agent.frame(mavlink.MAVLink_global_position_int_message(1, 470010000, 80020000, 530_000, 30_000, 0, 0, 0, 0))
    assert_problem(await scene.order(**here), 409, "moves-home")
    place = {"command": "set_home", "lat": 47.0, "lon": 8.0, "altitude_m": 480}
    assert_problem(await scene.order(**place), 409, "moves-home")
    done = (await scene.order(**here, while_flying=True)).json()
    assert done["state"] == "done"
    sent = scene.agent.asked[-1].work
    assert isinstance(sent, CommandWork)
    drone = scene.world.tower.hub.state.drones.get(DroneId(scene.agent.link.drone_id))
    assert drone is not None
    assert drone.home is not None
    assert (sent.command, sent.x, sent.y, sent.params[6]) == (179, 470010000, 80020000, drone.home.alt_amsl_m)
    assert sent.params[0] == 0.0


async def test_what_this_vehicle_cannot_do_is_refused_in_words(scene: CommandScene) -> None:
    place = {"lat": 47.0, "lon": 8.0, "height_m": 30}
    problem = assert_problem(await scene.order(command="orbit", **place, radius_m=20), 409, "not-supported")
    assert "kestrel" in problem["detail"]
    mode = assert_problem(await scene.order(command="mode", mode="AUTO.LOITER"), 422, "invalid-request")
    assert mode["errors"][0]["field"] == "mode"
    scene.agent.beat(px4=True)
    assert (await scene.order(command="orbit", **place, radius_m=20)).json()["state"] == "done"
    wrong = assert_problem(await scene.order(command="goto", lat=95, lon=0, height_m=1), 422, "invalid-request")
    assert "lat" in wrong["detail"]


async def test_too_much_in_too_short_a_time_is_turned_down_and_a_hold_is_not(
    scene: CommandScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flood_gate, "OPERATIONS_REFILLED_IN_S", 1e9)
    scene.world.tower.hub.state.shares.apply({ShareName.OPERATIONS: 2})
    for _ in range(2):
        assert (await scene.order(command="speed", m_s=5)).json()["state"] == "done"
    assert_problem(await scene.order(command="speed", m_s=5), 429, "too-many-operations")
    assert (await scene.order(command="hold")).json()["state"] == "done"


async def test_who_can_be_followed_by_whom(scene: CommandScene) -> None:
    scene.agent.state(armed=True, airborne=True)
    itself = assert_problem(await scene.order(command="follow", leader=scene.drone.id, up_m=10), 409, "cannot-follow")
    assert "kestrel cannot follow itself" in itself["detail"]
    hidden = await scene.world.add_drone("falcon", await scene.world.add_user("mallory"))
    for leader in (hidden.id, 999):
        wrong = assert_problem(await scene.order(command="follow", leader=leader, up_m=10), 422, "invalid-request")
        assert (wrong["errors"][0]["field"], "falcon" in str(wrong)) == ("leader", False)
    seen = await scene.world.add_drone("merlin", scene.alice)
    near = assert_problem(await scene.order(command="follow", leader=seen.id, up_m=5), 409, "cannot-follow")
    assert "too near to merlin: 8 m" in near["detail"]
    ground = assert_problem(await scene.order(command="follow", leader=seen.id, up_m=10), 409, "cannot-follow")
    assert "merlin is not in the air" in ground["detail"]
    assert_problem(await scene.order(scene.watcher, command="follow", leader=seen.id, up_m=10), 409, "not-in-control")
    assert scene.sent == []
