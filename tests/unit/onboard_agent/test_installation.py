"""What the doctor finds on this computer, and remedies that work on it."""

import os
from pathlib import Path

import pytest

from onboard_agent import VERSION
from onboard_agent.installation import ENVIRONMENT, camera_trouble, port_trouble, video_remedy


@pytest.fixture
def devices(tmp_path: Path) -> Path:
    folder = tmp_path / "dev"
    folder.mkdir()
    return folder


def test_a_port_that_is_not_there_is_answered_with_those_that_are(devices: Path) -> None:
    for name in ("ttyUSB1", "ttyACM0", "tty7", "video0", "null"):
        (devices / name).touch()
    (devices / "serial" / "by-id").mkdir(parents=True)
    (devices / "serial" / "by-id" / "usb-Pixhawk").touch()
    trouble = port_trouble(f"serial:{devices}/ttyUSB0:57600", devices)
    assert trouble is not None
    assert trouble.found == f"{devices}/ttyUSB0 is not there"
    names = ("serial/by-id/usb-Pixhawk", "ttyACM0", "ttyUSB1")
    assert trouble.remedy == f"this computer has {', '.join(f'{devices}/{name}' for name in names)}"


def test_a_computer_without_a_port(devices: Path) -> None:
    for autopilot in (f"serial:{devices}/serial0:921600", f"msp:{devices}/ttyACM0"):
        trouble = port_trouble(autopilot, devices)
        assert trouble is not None
        assert trouble.remedy.startswith("this computer has no port: plug it in, or on a Raspberry Pi: `raspi-config`")


@pytest.mark.parametrize("autopilot", ["udpin:0.0.0.0:14550", "tcp:127.0.0.1:5760", "msp:tcp:127.0.0.1:5761"])
def test_what_is_no_device_is_not_looked_for(autopilot: str) -> None:
    assert port_trouble(autopilot) is None


def test_a_port_of_another_group_names_the_group(devices: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    port = devices / "ttyACM0"
    port.touch()
    assert port_trouble(f"serial:{port}", devices) is None
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    trouble = port_trouble(f"serial:{port}:115200", devices)
    assert trouble is not None
    assert trouble.found == f"{port} may not be opened by this user"
    assert trouble.remedy.startswith("`usermod -aG ")


def test_a_camera_that_is_not_there(devices: Path) -> None:
    trouble = camera_trouble(f"v4l2:{devices}/video9@1280x720", devices)
    assert trouble == (f"{devices}/video9 is not there", "this computer has no camera: is it plugged in?")
    (devices / "video0").touch()
    trouble = camera_trouble(f"v4l2:{devices}/video9", devices)
    assert trouble is not None and trouble.remedy == f"this computer has {devices}/video0"
    assert camera_trouble("pi:0", devices) is None


def test_video_is_added_in_the_way_in_which_the_agent_came(tmp_path: Path) -> None:
    package_list = tmp_path / "control-tower-agent.list"
    wheel = f"`/opt/tower-agent/bin/pip install 'control_tower_agent-{VERSION}-py3-none-any.whl[video]'`"
    assert video_remedy(ENVIRONMENT, package_list, tmp_path).startswith(wheel)
    package_list.touch()
    assert "apt install ./control-tower-agent-video" in video_remedy(ENVIRONMENT, package_list, tmp_path)
    assert "/srv/agent/bin/pip install" in video_remedy(Path("/srv/agent"), package_list, tmp_path)
    assert video_remedy() == "`make setup` in the checkout"
