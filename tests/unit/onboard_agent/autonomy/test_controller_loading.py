"""Where a controller comes from: built in, a file, an entry point; and that the documented example flies."""

from __future__ import annotations

import re
from importlib import metadata
from pathlib import Path

import pytest
from controller_world import ControllerWorld

from onboard_agent.autonomy import loading
from onboard_agent.autonomy.loading import NoController, load
from onboard_agent.autonomy.scripted import Scripted
from wire.controllers import ControllerWork
from wire.transactions import Outcome

DOCUMENT = Path(__file__).parents[4] / "docs" / "controllers.md"


def example(folder: Path) -> str:
    """Writes the example of the documents to a file, and returns its source."""
    found = re.search(r"```python\n(.*?)```", DOCUMENT.read_text(), re.DOTALL)
    assert found is not None
    assert len(found[1].splitlines()) <= 35
    file = folder / "triangle.py"
    file.write_text(found[1])
    return f"{file}:Triangle"


def test_the_documented_example_flies_its_triangle(tmp_path: Path) -> None:
    controller = load("triangle", example(tmp_path))
    world = ControllerWorld(controller)
    world.ready().flies()
    number = world.begin(ControllerWork("triangle"), deadline_s=300.0)
    assert world.port.set_up is not None
    controller.begin(world.port.set_up)
    begun = world.where
    farthest = 0.0

    def over() -> bool:
        nonlocal farthest
        farthest = max(farthest, abs(world.where[0] - begun[0]) + abs(world.where[1] - begun[1]))
        return bool(world.results(number))

    world.until(over, 200.0, "the end")
    result = world.results(number)[-1]
    assert result.outcome is Outcome.DONE, result
    assert farthest > 11.0
    assert abs(world.where[0] - begun[0]) < 2.5
    assert abs(world.where[1] - begun[1]) < 2.5


def test_built_in_and_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert isinstance(load("scripted", ""), Scripted)
    entry = metadata.EntryPoint("other", "onboard_agent.autonomy.scripted:Scripted", loading.GROUP)

    def entry_points(*, group: str, name: str) -> list[metadata.EntryPoint]:
        return [entry] if (group, name) == ("control_tower.controllers", "other") else []

    monkeypatch.setattr(loading, "entry_points", entry_points)
    assert isinstance(load("other", ""), Scripted)
    with pytest.raises(NoController, match="no controller 'third'"):
        load("third", "")


def test_what_is_no_controller(tmp_path: Path) -> None:
    file = tmp_path / "none.py"
    file.write_text("class Thing:\n    pass\n")
    with pytest.raises(NoController, match="no method step"):
        load("thing", f"{file}:Thing")
    with pytest.raises(AttributeError):
        load("thing", f"{file}:Other")
    with pytest.raises(FileNotFoundError):
        load("thing", f"{tmp_path}/missing.py:Thing")
