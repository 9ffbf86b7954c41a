"""A gesture of sticks that the agent held back: in the audit trail, in the flight's record, and told to everybody."""

from pathlib import Path
from typing import Any

import pytest
from control_world import live
from flight_scene import FlightScene
from tower_world import start_tower

from server.flights.core import recorder
from wire.control_messages import AutopilotState


def report(scene: FlightScene, gestures: int, *, airborne: bool = True) -> None:
    state = AutopilotState(heard=True, armed=True, airborne=airborne, stick_gestures=gestures)
    scene.world.tower.hub.reports.receive(scene.agent.link, state)


async def rows(scene: FlightScene) -> list[dict[str, Any]]:
    await scene.world.tower.event_handler.caught_up()
    answer = await scene.admin.get("/api/v1/audit?action=control.stick_gesture")
    return [row["detail"] for row in answer.json()]


async def test_each_is_written_down_once_with_whose_sticks_they_were(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "AFTER_S", 0.3)
    async with start_tower(tmp_path) as world:
        scene = FlightScene(world)
        await scene.begin()
        scene.agent.state()
        async with live(world, scene.watcher) as browser:
            await scene.arm()
            for gestures in (0, 1, 1, 2):
                report(scene, gestures)
            text = (await browser.event("notice", code="stick-gesture"))["text"]
            assert text == "alice tried to arm or disarm kestrel by sticks. It was held back."
            report(scene, 0)  # the agent was started again
            report(scene, 1, airborne=False)
            scene.positions()
            await scene.land()
        by_alice = [{"user_id": scene.alice.id, "airborne": airborne} for airborne in (False, True, True)]
        assert await rows(scene) == by_alice
        (flight,) = await scene.ready()
        index = (await scene.holder.get(f"/api/v1/flights/{flight['id']}")).json()["index"]
        noted = [one for one in index if one["kind"] == "notice" and one["code"] == "stick-gesture"]
        assert [one["text"] for one in noted] == [text] * 3


async def test_what_an_agent_held_back_before_the_tower_knew_it_is_nobodys(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        scene = FlightScene(world)
        await scene.begin()
        world.tower.hub.state.drones[scene.drone.id].stick_gestures = None  # as after a start of the tower
        report(scene, 4)
        assert await rows(scene) == []
        report(scene, 5)
        assert len(await rows(scene)) == 1
