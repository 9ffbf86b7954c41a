"""The agent as a service: how it is started, upgraded and removed, with a `systemctl` of our own."""

import os
import socket
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from packages.debian import AGENT, AGENT_VIDEO, UPGRADE_PATIENCE_S, Package, before_upgrade

from onboard_agent.install import install, uninstall
from onboard_agent.installation import the_autopilot_on_usb
from onboard_agent.service import Service, is_packaged, require_reachable, unit_text
from onboard_agent.systemd import Systemd, service_status
from onboard_agent.unusable import Unusable

FLIES = service_status(linked=True, heard=True, armed=True)
READY = service_status(linked=True, heard=True, armed=False)
NO_TOWER = service_status(linked=False, heard=True, armed=False)


class Systemctl:
    """A program that notes how it was called. Its `status` is the service's line."""

    def __init__(self, folder: Path) -> None:
        self.program, self._calls, self._status = (folder / name for name in ("systemctl", "calls", "status"))
        self.program.write_text(
            f'#!/bin/sh\ncase "$*" in *StatusText*) cat {self._status};; *LoadState*) echo loaded;; '
            f"*) echo $* >> {self._calls};; esac\n"
        )
        self.program.chmod(0o755)
        self._calls.touch()
        self.status = ""

    @property
    def status(self) -> str:
        return self._status.read_text()

    @status.setter
    def status(self, line: str) -> None:
        self._status.write_text(f"{line}\n")

    @property
    def calls(self) -> list[str]:
        return self._calls.read_text().splitlines()


@pytest.fixture
def systemctl(tmp_path: Path) -> Systemctl:
    return Systemctl(tmp_path)


def test_a_start_tells_whether_tower_and_autopilot_are_there(systemctl: Systemctl) -> None:
    said: list[str] = []
    ours = Service(str(systemctl.program), said.append)
    systemctl.status = READY
    assert ours.start(wait_s=0)
    assert said == [f"started: {READY}"]
    systemctl.status = NO_TOWER
    assert not ours.start(wait_s=0)
    assert said[1:] == [
        f"!! started, but: {NO_TOWER}",
        "-> `tower-agent doctor` says what to do; `journalctl -u tower-agent` says more",
    ]
    assert systemctl.calls == ["restart tower-agent.service"] * 2


def test_nothing_restarts_or_removes_the_service_of_an_armed_drone(systemctl: Systemctl) -> None:
    said: list[str] = []
    ours = Service(str(systemctl.program), said.append)
    systemctl.status = FLIES
    assert not ours.start(wait_s=0)
    assert said[0].startswith("!! the drone is armed")
    with pytest.raises(Unusable, match="armed"):
        ours.remove()
    assert systemctl.calls == []
    systemctl.status = READY
    assert ours.remove()
    assert systemctl.calls == ["disable --now tower-agent.service"]


@pytest.mark.parametrize("package", [AGENT, AGENT_VIDEO], ids=["agent", "video"])
@pytest.mark.parametrize(
    ("verb", "status", "code"), [("upgrade", FLIES, 1), ("upgrade", READY, 0), ("install", FLIES, 0)]
)
def test_a_package_replaces_nothing_while_the_drone_is_armed(
    systemctl: Systemctl, tmp_path: Path, package: Package, verb: str, status: str, code: int
) -> None:
    systemctl.status = status
    script = tmp_path / "preinst"
    # This computer need not run systemd, and nobody waits ten minutes.
    script.write_text(
        before_upgrade(package).replace("[ -d /run/systemd/system ]", "true").replace(str(UPGRADE_PATIENCE_S), "0")
    )
    path = f"{tmp_path}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["sh", str(script), verb, "0.2.0"], env={"PATH": path}, capture_output=True, text=True, timeout=30, check=False
    )
    assert done.returncode == code, done.stdout + done.stderr
    assert ("nothing was changed" in done.stderr) is (code == 1)


def test_an_armed_drone_on_the_same_line_counts_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        systemd.settimeout(5)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        speaks, beside = Systemd(), Systemd(speaks=False)
        for armed, line in ((False, READY), (True, FLIES), (False, READY)):
            beside.status(linked=True, heard=True, armed=armed)
            speaks.status(linked=True, heard=True, armed=False)
            assert systemd.recv(200).decode() == f"STATUS={line}"
        assert speaks._socket is not None
        speaks._socket.close()


def test_the_unit_sees_an_agent_below_a_home(tmp_path: Path) -> None:
    program = Path("/opt/tower-agent/bin/tower-agent")
    assert "\nProtectHome=yes\n" in unit_text(program, [program])
    clone = Path("/home/pi/tower/.venv/bin/tower-agent")
    text = unit_text(clone, [Path("/usr"), clone])
    assert "\nProtectHome=read-only\n" in text
    assert f"\nExecStart={clone} run " in text


def test_an_agent_where_its_service_cannot_enter_is_refused() -> None:
    with TemporaryDirectory() as folder:
        home = Path(folder)
        (home / "tower").mkdir()
        home.chmod(0o755)
        require_reachable([home / "tower" / "agent"])
        home.chmod(0o700)
        with pytest.raises(Unusable, match=f"may not enter {home}, .*chmod o\\+x {home}"):
            require_reachable([home / "tower" / "agent"])


def test_a_packages_unit_is_used_as_it_is(tmp_path: Path) -> None:
    program = Path("/opt/tower-agent/bin/tower-agent")
    assert not is_packaged(program, tmp_path)
    unit = tmp_path / "usr/lib/systemd/system/tower-agent.service"
    unit.parent.mkdir(parents=True)
    unit.write_text(unit_text(program, [program]))
    assert is_packaged(program, tmp_path)
    assert not is_packaged(Path("/srv/agent/bin/tower-agent"), tmp_path)


@pytest.mark.parametrize(
    ("ports", "chosen"),
    [
        (["usb-Holybro_Pixhawk6X_1-if00", "usb-Holybro_Pixhawk6X_1-if02"], "usb-Holybro_Pixhawk6X_1-if00"),
        (["usb-FTDI_FT232R_A10-if00-port0"], "usb-FTDI_FT232R_A10-if00-port0"),
        (["usb-FTDI_FT232R_A10-if00-port0", "usb-Holybro_Pixhawk6X_1-if00"], None),
        ([], None),
    ],
)
def test_the_one_autopilot_on_usb_need_not_be_named(tmp_path: Path, ports: list[str], chosen: str | None) -> None:
    folder = tmp_path / "serial" / "by-id"
    folder.mkdir(parents=True)
    (tmp_path / "ttyAMA0").touch()
    for name in ports:
        (folder / name).touch()
    if chosen is None:
        with pytest.raises(Unusable, match=r"give --autopilot, .*; this computer has .*ttyAMA0"):
            the_autopilot_on_usb(tmp_path)
    else:
        assert the_autopilot_on_usb(tmp_path) == f"serial:{folder / chosen}"


def test_install_may_be_repeated_and_uninstall_takes_it_back(tmp_path: Path) -> None:
    root = tmp_path / "root"
    port = tmp_path / "dev" / "serial" / "by-id" / "usb-Holybro_Pixhawk6X_1-if00"
    port.parent.mkdir(parents=True)
    port.touch()
    options = {"root": root, "tower": "https://tower.example.org", "enrol": None, "no_start": False}
    for _ in range(2):
        assert install(options, tmp_path / "dev")
    assert f'autopilot = "serial:{port}"' in (root / "etc/tower-agent/agent.toml").read_text()
    (root / "etc/tower-agent/token").write_text("twk_")
    for _ in range(2):
        assert uninstall({"root": root})
    assert [path for path in root.rglob("*") if path.is_file()] == []
    assert not (root / "etc/tower-agent").exists()
