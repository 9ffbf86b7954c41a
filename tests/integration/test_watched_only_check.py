"""A vehicle that is watched only: its check before flight is complete, whatever parameters its autopilot lacks."""

from pathlib import Path

from flying_scene import Scene
from tower_world import start_tower

from wire.control_messages import AutopilotState


async def test_nothing_more_is_waited_for(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        await scene.begin()
        scene.agent.parameters(complete=False)
        assert (await scene.holder.get(f"{scene.path}/loss-check")).json()["complete"] is False
        state = AutopilotState(heard=True, armed=False, airborne=False, watched_only=True)
        world.tower.hub.reports.receive(scene.agent.link, state)
        check = (await scene.holder.get(f"{scene.path}/loss-check")).json()
        assert check["complete"] is True
        assert [one["severity"] for one in check["sentences"]] == ["warning"]
        assert "watched only" in check["sentences"][0]["text"]
