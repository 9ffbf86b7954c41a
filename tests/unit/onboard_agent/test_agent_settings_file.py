"""The agent's settings from command line, environment and file: which counts, and that each key is documented."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from onboard_agent.command_line import command_line
from onboard_agent.settings import FILE_VARIABLE, KEYS, SETTINGS, as_toml, read_settings
from onboard_agent.unusable import Unusable
from onboard_agent.update import launch
from server.runtime.settings import variables

CHECKOUT = Path(__file__).parents[3]
NOTHING: dict[str, Any] = dict.fromkeys(KEYS)
FILE = 'tower = "https://file"\ntoken = "/file"\nautopilot = "udpin:0.0.0.0:1"\nuplinks = ["wlan0", "wwan0"]\n'


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "agent.toml"
    path.write_text(FILE)
    return path


def test_the_command_line_counts_more_than_a_variable_and_that_more_than_the_file(file: Path) -> None:
    assert read_settings(NOTHING, {}, file)["tower"] == "https://file"
    environment = {"TOWER_AGENT_TOWER": "https://variable"}
    assert read_settings(NOTHING, environment, file)["tower"] == "https://variable"
    assert read_settings({**NOTHING, "tower": "https://option"}, environment, file)["tower"] == "https://option"


def test_a_variable_names_the_file(file: Path) -> None:
    found = read_settings(NOTHING, {FILE_VARIABLE: str(file)})
    assert found["uplinks"] == ["wlan0", "wwan0"]
    assert (found["camera"], found["log_level"], found["state"]) == ("none", "info", None)


def test_systemd_says_where_the_state_lies_unless_a_variable_does(file: Path) -> None:
    assert read_settings(NOTHING, {"STATE_DIRECTORY": "/systemd"}, file)["state"] == "/systemd"
    environment = {"STATE_DIRECTORY": "/systemd", "TOWER_AGENT_STATE": "/own"}
    assert read_settings(NOTHING, environment, file)["state"] == "/own"


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("TOWER_AGENT_UPLINK", r"TOWER_AGENT_UPLINK is not a setting of the agent: did you mean TOWER_AGENT_UPLINKS\?"),
        ("TOWER_AGENT_XYZ_QQ", "TOWER_AGENT_XYZ_QQ is not a setting of the agent"),
    ],
)
def test_a_misspelt_variable_is_named_with_the_nearest(file: Path, name: str, why: str) -> None:
    with pytest.raises(Unusable, match=why):
        read_settings(NOTHING, {name: "wlan0"}, file)
    read_settings(NOTHING, {name: " "}, file)


def test_variables_of_its_launcher_and_of_a_tower_are_no_mistakes(file: Path) -> None:
    of_launcher = [getattr(launch, name) for name in ("RELEASE", "TRANSACTION", "INSTALLED", "_BASE_PATH", "_ABOVE")]
    read_settings(NOTHING, dict.fromkeys((*of_launcher, *variables().values()), "x"), file)


def test_uplinks_in_a_variable_have_commas(file: Path) -> None:
    assert read_settings(NOTHING, {"TOWER_AGENT_UPLINKS": "eth0,wwan1"}, file)["uplinks"] == ["eth0,wwan1"]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("towr = 'x'", "no setting 'towr' (did you mean tower?); known: tower"),
        ("wings = 'x'", "no setting 'wings'; known: tower"),
        ("tower = 5", "tower must be a text in quotes"),
        ("uplinks = 'wlan0'", "uplinks must be a list"),
        ("tower = ", "is not TOML"),
    ],
)
def test_a_mistake_in_the_file_is_named(tmp_path: Path, text: str, why: str) -> None:
    path = tmp_path / "agent.toml"
    path.write_text(text)
    with pytest.raises(Unusable, match=re.escape(why)):
        read_settings(NOTHING, {}, path)


def test_a_file_that_was_named_must_be_there(tmp_path: Path) -> None:
    with pytest.raises(Unusable, match="cannot be read"):
        read_settings(NOTHING, {}, tmp_path / "nothing.toml")


def test_what_must_be_set_is_named_with_all_ways_to_set_it(tmp_path: Path) -> None:
    empty = tmp_path / "empty.toml"
    empty.touch()
    with pytest.raises(
        Unusable, match=r"^tower is not set: give --tower, TOWER_AGENT_TOWER; token .*, or each in /etc"
    ):
        read_settings(NOTHING, {}, empty)
    with pytest.raises(Unusable, match=r"^tower is not set: give --tower, TOWER_AGENT_TOWER, or tower in /etc"):
        read_settings({"tower": None}, {}, empty)
    assert read_settings(NOTHING, {}, empty, complete=False)["tower"] is None


def test_the_example_shows_every_key_and_can_be_used() -> None:
    example = (CHECKOUT / "deploy" / "agent.toml").read_text()
    assert example == as_toml({"tower": KEYS["tower"].example, "autopilot": KEYS["autopilot"].example})
    uncommented = re.sub(r"^# (\w+ = )", r"\1", example, flags=re.MULTILINE)
    assert set(tomllib.loads(uncommented)) == set(KEYS)


def test_the_documents_describe_every_key_with_its_option_and_variables() -> None:
    table = (CHECKOUT / "docs" / "agent.md").read_text()
    for one in SETTINGS:
        row = next((line for line in table.splitlines() if line.startswith(f"| `{one.key}` |")), "")
        assert f"`{one.flag}`" in row, one.key
        assert all(f"`{variable}`" in row for variable in one.variables), one.key


def test_run_and_doctor_take_every_setting() -> None:
    for command in ("run", "doctor"):
        said = vars(command_line("1").parse_args([command]))
        assert set(KEYS) <= set(said)


def test_a_written_file_reads_back(tmp_path: Path) -> None:
    values = {"tower": 'https://a"b\\c', "autopilot": "udpin:0.0.0.0:1", "uplinks": ["ä", "b"]}
    path = tmp_path / "agent.toml"
    path.write_text(as_toml(values))
    assert {key: value for key, value in read_settings({}, {}, path).items() if key in values} == values
