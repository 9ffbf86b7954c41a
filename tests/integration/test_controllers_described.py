"""What a controller of a file says of its settings, read by the agent in a process of its own."""

from pathlib import Path

from onboard_agent.autonomy.describing import descriptions
from wire.controller_settings import ControllerDescribed

DESCRIBED = """
from onboard_agent.autonomy.controller import Controller, ControllerSetting, SettingKind

print("loaded")

class Survey(Controller):
    described_settings = [
        ControllerSetting(name="side_m", kind=SettingKind.NUMBER, default=12.0, label="Side", unit="m", least=2.0)
    ]
    def step(self, seen): ...
"""
SILENT = "class Silent:\n    def step(self, seen): ...\n"
WRONG = "class Wrong:\n    described_settings = [{'name': 'A b'}]\n    def step(self, seen): ...\n"


async def test_files_are_described_and_what_fails_stops_no_other(tmp_path: Path) -> None:
    sources = {}
    for name, code in (("broken", "1/0"), ("wrong", WRONG), ("silent", SILENT), ("survey", DESCRIBED)):
        (tmp_path / f"{name}.py").write_text(code)
        sources[name] = f"{tmp_path}/{name}.py:{name.capitalize()}"
    found: list[ControllerDescribed] = [one async for one in descriptions(sources)]
    (survey,) = found
    assert survey.controller == "survey"
    assert [(one.name, one.default, one.unit, one.least) for one in survey.settings] == [("side_m", 12.0, "m", 2.0)]
