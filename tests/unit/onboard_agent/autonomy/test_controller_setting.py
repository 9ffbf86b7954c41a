"""The setting `controllers`, and that an agent without a running controller has nothing of it in memory."""

import subprocess
import sys

import pytest

from onboard_agent.autonomy.setting import names_on_board, parse_controllers
from onboard_agent.unusable import Unusable


def test_names_and_files() -> None:
    found = parse_controllers(["survey=/opt/c/survey.py:Survey", "look-2=/a.py:B"])
    assert found == {"survey": "/opt/c/survey.py:Survey", "look-2": "/a.py:B"}


@pytest.mark.parametrize(
    "texts",
    [["survey"], ["survey=relative.py:A"], ["Survey=/a.py:A"], ["a=/a.py"], ["a=/a.so:A"], ["a=/a.py:A", "a=/b.py:B"]],
)
def test_what_is_none(texts: list[str]) -> None:
    with pytest.raises(Unusable, match="controllers"):
        parse_controllers(texts)


def test_the_names_that_the_tower_is_told() -> None:
    assert names_on_board({"survey": "/opt/c/survey.py:Survey", "scripted": "/a.py:B"}) == [
        "challenge",
        "scripted",
        "survey",
    ]


def test_an_idle_agent_has_loaded_no_more_than_the_handler() -> None:
    said = (
        "import sys, onboard_agent.cli; print(*[one for one in sys.modules if one.startswith('onboard_agent.auton')])"
    )
    done = subprocess.run([sys.executable, "-c", said], capture_output=True, text=True, check=True, timeout=60)
    loaded = {name for name in done.stdout.split() if not name.startswith("onboard_agent.autopilot")}
    assert loaded == {"onboard_agent.autonomy", "onboard_agent.autonomy.service", "onboard_agent.autonomy.setting"}
