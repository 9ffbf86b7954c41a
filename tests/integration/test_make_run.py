"""`make run` as a program: Ctrl-C while it makes its first account, then a second run that flies."""

import json
import os
import re
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from worlds.free_ports import free_tcp_port, free_udp_ports
from worlds.processes import CHECKOUT, PASSWORD, Visitor, wait_for

pytestmark = pytest.mark.long("a demonstration's first start, interrupted")

Started = Callable[[], subprocess.Popen[bytes]]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Started]:
    """Starts what `make run` starts, with one drone. The file `said` has its output."""
    environment = {
        **os.environ,
        "TOWER_VAR": str(tmp_path / "var"),
        "TOWER_PORT": str(free_tcp_port()),
        "TOWER_UDP_PORT": str(free_udp_ports(1)[0]),
        "TOWER_ADMIN_PASSWORD": PASSWORD,
        "SQUAD": "1",
    }
    started: list[subprocess.Popen[bytes]] = []

    def go() -> subprocess.Popen[bytes]:
        with (tmp_path / "said").open("wb") as said:
            # A process group of its own, as in a terminal: Ctrl-C reaches every process in it.
            command = [sys.executable, str(CHECKOUT / "deploy" / "run_local.py")]
            started.append(
                subprocess.Popen(
                    command, env=environment, stdout=said, stderr=subprocess.STDOUT, start_new_session=True
                )
            )
        return started[-1]

    yield go
    for process in started:
        if process.poll() is None:
            process.terminate()
            process.wait(30)


def press_ctrl_c(process: subprocess.Popen[bytes]) -> None:
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(30) == 0


def test_what_was_interrupted_while_it_made_accounts_goes_on(start: Started, tmp_path: Path) -> None:
    squad = tmp_path / "var" / "squad.json"
    first = start()
    wait_for("the first account", squad.exists)
    press_ctrl_c(first)
    assert json.loads(squad.read_text())["drones"] == {}

    second = start()

    def address() -> str | None:
        text = (tmp_path / "said").read_text()
        assert second.poll() is None, text
        return text.split("is running at", 1)[1].split()[0] if "Ctrl-C ends it all" in text else None

    admin = Visitor(wait_for("make run", address, timeout_s=240.0)).sign_in("admin")
    wait_for("Kestrel online", lambda: admin.drone(1).get("online"))
    camera = re.search(r"http://\S+/camera", (tmp_path / "var" / "log" / "simulator.log").read_text())
    assert camera is not None
    with urllib.request.urlopen(camera[0], timeout=60) as pictures:
        assert pictures.readline().startswith(b"--")
        assert pictures.readline() == b"Content-Type: image/jpeg\r\n"
    operators = {name: Visitor(admin.address) for name in ("alice", "bob")}
    for name, password in json.loads(squad.read_text())["first_passwords"].items():
        if name in operators:
            operators[name].sign_in(name, password)
    press_ctrl_c(second)
