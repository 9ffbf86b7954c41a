"""The systemd unit agrees with the program that it starts."""

from configparser import ConfigParser
from pathlib import Path

import pytest

from onboard_agent.cli import UNUSABLE_EXIT_CODE
from onboard_agent.video.__main__ import OOM_SCORE

UNIT = Path(__file__).parents[3] / "deploy" / "tower-agent.service"


@pytest.fixture
def service() -> dict[str, str]:
    unit = ConfigParser(strict=False, interpolation=None)
    unit.optionxform = str  # type: ignore[assignment,method-assign]
    unit.read_string(UNIT.read_text())
    return dict(unit["Service"])


def test_what_a_restart_does_not_cure_is_not_restarted(service: dict[str, str]) -> None:
    assert service["Restart"] == "always"
    assert service["RestartPreventExitStatus"] == str(UNUSABLE_EXIT_CODE)


def test_the_agent_tells_systemd_how_it_is(service: dict[str, str]) -> None:
    assert service["Type"] == "notify"
    assert int(service["WatchdogSec"]) >= 5


def test_the_credential_comes_by_a_private_copy(service: dict[str, str]) -> None:
    assert service["LoadCredential"].startswith("token:")
    assert service["ExecStart"].endswith("run --token ${CREDENTIALS_DIRECTORY}/token")


def test_it_has_a_place_for_what_must_outlast_it(service: dict[str, str]) -> None:
    assert service["StateDirectory"] == "tower-agent"
    assert service["StateDirectoryMode"] == "0700"


@pytest.mark.parametrize("name", ["DynamicUser", "NoNewPrivileges", "ProtectHome", "MemoryDenyWriteExecute"])
def test_it_is_locked_in(service: dict[str, str], name: str) -> None:
    assert service[name] == "yes"
    assert service["ProtectSystem"] == "strict"


def test_a_video_process_that_needs_too_much_memory_does_not_take_the_agent_with_it(service: dict[str, str]) -> None:
    assert service["OOMPolicy"] == "continue"
    assert int(service["OOMScoreAdjust"]) < 0 < OOM_SCORE


def test_the_video_process_may_step_back_and_open_a_camera() -> None:
    lines = UNIT.read_text().splitlines()
    filters = [line for line in lines if line.startswith("SystemCallFilter=")]
    assert "setpriority" in filters[-1], "after what takes it away with the others"
    assert "DeviceAllow=char-video4linux rw" in lines
    assert any(line.startswith("SupplementaryGroups=") and "video" in line for line in lines)
