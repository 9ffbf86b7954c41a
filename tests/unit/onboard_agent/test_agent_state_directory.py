"""Where an agent keeps its persistent state: one folder for each drone, and a clear message if there is none."""

import sys
from pathlib import Path
from subprocess import PIPE, Popen

import pytest

from onboard_agent.state_directory import claim, state_directory
from wire.ids import DroneId


def test_each_drone_has_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert state_directory(tmp_path, DroneId(7)) == tmp_path / "drone-7"
    assert state_directory(tmp_path, DroneId(8)) == tmp_path / "drone-8"
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert state_directory(None, DroneId(7)) == tmp_path / "tower-agent" / "drone-7"
    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert state_directory(None, DroneId(7)) == tmp_path / ".local" / "state" / "tower-agent" / "drone-7"


def test_it_is_made_for_its_owner_only_and_what_is_in_the_way_is_said(tmp_path: Path) -> None:
    folder = state_directory(tmp_path / "state", DroneId(7))
    assert claim(folder) is None
    assert folder.stat().st_mode & 0o777 == 0o700
    assert claim(folder) is None
    (tmp_path / "file").write_text("")
    why_not = claim(state_directory(tmp_path / "file", DroneId(7)))
    assert why_not is not None and "no plan will be written" in why_not


OTHER_AGENT = """
import sys
import sys
from pathlib import Path
from subprocess import PIPE, Popen
from onboard_agent.state_directory import claim
print(claim(Path(sys.argv[1])), flush=True)
sys.stdin.read()
"""


def test_a_second_agent_gets_the_folder_only_when_the_first_has_ended(tmp_path: Path) -> None:
    with Popen([sys.executable, "-c", OTHER_AGENT, tmp_path], stdin=PIPE, stdout=PIPE, text=True) as other:
        assert other.stdout is not None and other.stdin is not None
        assert other.stdout.readline() == "None\n"
        why_not = claim(tmp_path)
        assert why_not is not None and "another agent" in why_not and "no plan will be written" in why_not
        other.kill()
    assert claim(tmp_path) is None
    assert claim(tmp_path) is None, "a process that starts its agent again is no second one"
