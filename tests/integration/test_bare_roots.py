"""A new companion computer: the pasted command, a restart of the computer, an upgrade in flight, and a purge.

The computers are Debian, made by debootstrap and started by systemd-nspawn with a systemd of their own. They share this
machine's loopback, where a tower and a simulated drone run.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest
from packages.debian import AGENT, build_deb
from packages.repository import SYSTEMS, System
from release import filler
from worlds.clean_install import build_wheels
from worlds.free_ports import free_udp_ports
from worlds.pilot import at_the_controls
from worlds.processes import PASSWORD, World

pytestmark = pytest.mark.long("makes and starts whole computers")

HOME = "47.3977,8.5456,488,0"
PACKAGES = "systemd,systemd-sysv,dbus,python3,ca-certificates,sudo"
BOOT_PATIENCE_S = 120.0
LAND = 21
ROOTS = "BARE_ROOTS"
"""A folder with roots by their codenames, made before."""
STATUS = "systemctl show --property=StatusText tower-agent"


def eventually(what: str, condition: Callable[[], object], patience_s: float = BOOT_PATIENCE_S) -> None:
    until = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < until, f"not within {patience_s} s: {what}"
        time.sleep(0.3)


def answer(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


class Computer:
    """A root that systemd-nspawn starts."""

    def __init__(self, root: Path, log: Path) -> None:
        self.root = root
        self._log = log
        self._nspawn: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        command = ["systemd-nspawn", "--quiet", "--register=no", "--keep-unit", "--boot", f"--directory={self.root}"]
        with self._log.open("ab") as log:
            self._nspawn = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)
        eventually("the computer to be up", self._is_up)

    @property
    def _init(self) -> str:
        """The process id of its first process on this machine; empty: it is not up."""
        assert self._nspawn is not None
        return Path(f"/proc/{self._nspawn.pid}/task/{self._nspawn.pid}/children").read_text().strip()

    def _is_up(self) -> bool:
        return bool(self._init) and self._shell("systemctl is-system-running").stdout.strip() in ("running", "degraded")

    def _shell(self, line: str, patience_s: float = 60) -> subprocess.CompletedProcess[str]:
        enter = ["nsenter", "--all", f"--target={self._init}", "env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin"]
        return subprocess.run(
            [*enter, "LANG=C.UTF-8", "sh", "-c", line], capture_output=True, text=True, timeout=patience_s, check=False
        )

    def run(self, line: str, *, code: int = 0, patience_s: float = 60) -> str:
        done = self._shell(line, patience_s)
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout + done.stderr

    def stop(self) -> None:
        if self._nspawn is None or self._nspawn.poll() is not None:
            return
        self._shell("systemctl poweroff")
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._nspawn.wait(60)
        if self._nspawn.poll() is None:
            self._nspawn.send_signal(signal.SIGKILL)
            self._nspawn.wait(10)


def mirror() -> str:
    """Where this machine's own Debian gets its packages from."""
    found = subprocess.run(
        ["apt-get", "indextargets", "--format", "$(SITE)"], capture_output=True, text=True, check=True
    )
    return next(line for line in found.stdout.splitlines() if re.search(r"/debian/?$", line))


@pytest.fixture(params=SYSTEMS, ids=lambda one: one.codename)
def system(request: pytest.FixtureRequest) -> System:
    return request.param


@pytest.fixture
def debs(system: System, tmp_path: Path) -> dict[str, Path]:
    """The agent's package in two versions."""
    wheel = build_wheels(tmp_path / "wheels", AGENT.name)[AGENT.name]
    machine = subprocess.run(
        ["dpkg", "--print-architecture"], capture_output=True, text=True, check=True
    ).stdout.strip()
    fill = filler(AGENT, wheel, machine, system, tmp_path)
    return {
        version: build_deb(
            AGENT,
            version=version,
            architecture=machine,
            python=system.python,
            mark=system.mark,
            fill=fill,
            work=tmp_path / version,
            out=tmp_path,
            compression="none",
        )
        for version in ("0.3.0", "0.3.1")
    }


@pytest.fixture
def computer(system: System, tmp_path: Path, missing: Callable[[str], None]) -> Iterator[Computer]:
    if os.geteuid() != 0:
        missing("root")
    for program in ("debootstrap", "systemd-nspawn"):
        if shutil.which(program) is None:
            missing(f"{program} (Debian: apt-get install debootstrap systemd-container)")
    root = tmp_path / system.codename
    made = os.environ.get(ROOTS)
    if made is not None and (Path(made) / system.codename).is_dir():
        subprocess.run(["cp", "-a", "--reflink=auto", str(Path(made) / system.codename), str(root)], check=True)
    elif not system.mark.startswith("deb"):
        pytest.skip(f"a root of {system.title} is made by hand: name its folder's parent in {ROOTS}")
    else:
        command = ["debootstrap", "--variant=minbase", f"--include={PACKAGES}", system.codename, str(root), mirror()]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, timeout=900)
    here = Computer(root, tmp_path / "computer.log")
    here.start()
    try:
        yield here
    finally:
        here.stop()


def test_a_new_computer(computer: Computer, debs: dict[str, Path], tmp_path: Path) -> None:
    with World(tmp_path / "world") as world:
        world.add_user("admin", "admin")
        drone_id = world.add_drone("Kestrel")
        world.start_tower()
        admin = world.visitor("admin")
        [port] = free_udp_ports(1)
        with httpx.Client(base_url=world.address, trust_env=False, timeout=20) as client:
            client.post("/api/v1/session", json={"name": "admin", "password": PASSWORD})
            wanted = {"autopilot": f"udpin:127.0.0.1:{port}"}
            pasted = client.post(f"/api/v1/drones/{drone_id}/enrolments", json=wanted).json()["command"]
        world.start("simulator", "tower-sim", "--home", HOME, "--out", f"udp:127.0.0.1:{port}", "--boot-s", "1")

        for version, deb in debs.items():
            shutil.copy(deb, computer.root / "root" / f"{version}.deb")
        computer.run("useradd --create-home pi && echo 'pi ALL=(ALL) NOPASSWD: ALL' > /etc/sudoers.d/pi")
        computer.run("dpkg --install /root/0.3.0.deb")

        # A person who is not root pastes it.
        (computer.root / "home" / "pi" / "paste").write_text(pasted)
        said = computer.run("runuser -u pi -- sh /home/pi/paste")
        assert "sudo asks for your password" in said
        assert "this is Kestrel now" in said
        assert "started: tower linked, autopilot heard, disarmed" in said
        world.wait_until_online(admin, drone_id)
        assert not (computer.root / "etc/systemd/system/tower-agent.service").exists()  # the package's own
        again = computer.run("tower-agent install")
        assert "started: tower linked, autopilot heard, disarmed" in again

        computer.stop()
        computer.start()
        eventually(
            "the agent to be linked", lambda: "tower linked" in computer.run("systemctl status tower-agent; true")
        )
        world.wait_until_online(admin, drone_id)

        async def upgrade_in_flight() -> None:
            async with at_the_controls(admin, drone_id) as pilot:
                await pilot.take_off(3.0)
                upgrade = asyncio.create_task(
                    asyncio.to_thread(computer.run, "dpkg --install /root/0.3.1.deb", patience_s=300)
                )
                await asyncio.sleep(4)  # it would have been through in two
                assert not upgrade.done()
                assert computer.run("tower-agent install", code=1).count("the drone is armed") == 1
                await pilot.command(LAND)
                await pilot.until(lambda: not pilot.armed, "Kestrel on the ground")
                said = await upgrade
                assert "The drone is armed: the upgrade waits" in said
                assert "Setting up control-tower-agent (0.3.1" in said

        asyncio.run(upgrade_in_flight())
        world.wait_until_online(admin, drone_id)

        computer.run("dpkg --purge control-tower-agent")
        assert computer.run("systemctl is-active tower-agent; true").strip() == "inactive"
        for path in ("etc/tower-agent", "opt/tower-agent", "var/lib/private/tower-agent", "usr/bin/tower-agent"):
            assert not (computer.root / path).exists(), path
