"""What is released, away from the checkout: wheels in environments of their own, and packages for Debian.

Each environment has only what the wheel's metadata declares. The programs run in an empty folder with an empty
environment, so that nothing of the checkout helps them.
"""

import asyncio
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import pytest
from packages.debian import AGENT, TOWER, Package, build_deb, debian_version
from worlds.clean_install import build_wheels, closure, fill, install
from worlds.free_ports import free_tcp_port, free_udp_ports
from worlds.pilot import at_the_controls
from worlds.processes import PASSWORD, Visitor, wait_for

from onboard_agent import VERSION as AGENT_VERSION
from server import VERSION

pytestmark = pytest.mark.long("wheels and packages for Debian in clean roots")

MAX_IDLE_KIB: Final = 52 * 1024
MAX_BASE_BYTES = 100_000_000
SPACE_BYTES: Final = 4_000_000_000
HOME = "47.3977,8.5456,488,0"
PYTHON = f"{sys.version_info.major}.{sys.version_info.minor}"


@dataclass
class Machine:
    """An empty folder, and programs that know nothing else."""

    home: Path
    running: list[subprocess.Popen[bytes]] = field(default_factory=list)
    environment: dict[str, str] = field(default_factory=dict)

    def run(self, *command: str | Path, stdin: str = "", code: int = 0) -> str:
        done = subprocess.run(
            [str(word) for word in command],
            cwd=self.home,
            env=self._environment,
            input=stdin,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=90,
            check=False,
        )
        assert done.returncode == code, done.stdout
        return done.stdout

    def start(self, name: str, *command: str | Path) -> subprocess.Popen[bytes]:
        with (self.home / f"{name}.log").open("wb") as log:
            process = subprocess.Popen(
                [str(word) for word in command],
                cwd=self.home,
                env=self._environment,
                stdout=log,
                stderr=subprocess.STDOUT,
                stdin=subprocess.DEVNULL,
            )
        self.running.append(process)
        return process

    def said(self, name: str) -> str:
        return (self.home / f"{name}.log").read_text(errors="replace")

    def find(self, name: str, pattern: str) -> str:
        return wait_for(f"{pattern} in what {name} says", lambda: (m := re.search(pattern, self.said(name))) and m[1])

    @property
    def _environment(self) -> Mapping[str, str]:
        return {"PATH": os.defpath, "HOME": str(self.home), "LANG": "C.UTF-8", **self.environment}

    def end(self) -> None:
        for process in reversed(self.running):
            if process.poll() is None:
                process.terminate()
                process.wait(20)


@pytest.fixture(scope="module")
def space(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder for two gigabytes, in memory where there is room. On a disk, databases of other tests wait seconds for
    their commits until all of it is written."""
    memory = Path("/dev/shm")
    if (
        memory.is_dir()
        and not os.statvfs(memory).f_flag & os.ST_NOEXEC
        and shutil.disk_usage(memory).free > SPACE_BYTES
    ):
        with tempfile.TemporaryDirectory(dir=memory) as folder:
            yield Path(folder)
    else:
        yield tmp_path_factory.mktemp("space")


@pytest.fixture(scope="module")
def wheels(space: Path) -> dict[str, Path]:
    folder = space / "wheels"
    folder.mkdir()
    return build_wheels(folder, "control-tower", "control-tower-agent")


@pytest.fixture(scope="module")
def tower_programs(wheels: dict[str, Path], space: Path) -> Path:
    return install(space / "tower", wheels["control-tower"])


@pytest.fixture(scope="module")
def agent_programs(wheels: dict[str, Path], space: Path) -> Path:
    return install(space / "agent", wheels["control-tower-agent"])


@pytest.fixture(scope="module")
def ground(tower_programs: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machine]:
    """A machine on which `tower serve` was started in an empty folder."""
    machine = Machine(tmp_path_factory.mktemp("ground"))
    port, udp_port = free_tcp_port(), free_udp_ports(1)[0]
    machine.environment = {"TOWER_PORT": str(port), "TOWER_UDP_PORT": str(udp_port)}
    machine.start("tower", tower_programs / "tower", "serve")
    try:
        yield machine
    finally:
        machine.end()


@pytest.fixture(scope="module")
def address(ground: Machine) -> str:
    return ground.find("tower", r"Control Tower is at (http://\S+)")


@pytest.fixture
def drone(tmp_path: Path) -> Iterator[Machine]:
    machine = Machine(tmp_path)
    try:
        yield machine
    finally:
        machine.end()


def test_versions(tower_programs: Path, agent_programs: Path, drone: Machine) -> None:
    assert drone.run(tower_programs / "tower", "--version") == f"{VERSION}\n"
    assert drone.run(agent_programs / "tower-agent", "--version") == f"{AGENT_VERSION}\n"
    assert VERSION == AGENT_VERSION


def test_a_tower_from_its_wheel_serves_its_console_in_an_empty_folder(
    ground: Machine, address: str, tower_programs: Path
) -> None:
    password = ground.find("tower", r"first user is admin with the password (\S+),")
    assert ((ground.home / "var").stat().st_mode & 0o077) == 0
    visitor = Visitor(address)
    page = visitor.fetch("/")
    assert page.status == 200
    script = re.search(rb'src="\.?(/assets/[^"]+\.js)"', page.body)
    assert script is not None
    assert visitor.fetch(script[1].decode()).status == 200
    signed_in = visitor.sign_in("admin", password)
    assert signed_in.ask("GET", "/health").json == {"status": "ok", "version": VERSION}
    assert "admin" in ground.run(tower_programs / "tower", "user", "list")


def test_an_agent_alone_from_its_wheel_flies_a_simulator_through_that_tower(
    ground: Machine, address: str, tower_programs: Path, agent_programs: Path, drone: Machine
) -> None:
    tower, agent = tower_programs / "tower", agent_programs / "tower-agent"
    ground.run(tower, "user", "add", "alice", "--password-stdin", "--for-good", stdin=PASSWORD)
    token = drone.home / "token"
    ground.run(tower, "drone", "add", "Kestrel", "--owner", "alice", "--token-file", token)
    port = free_udp_ports(1)[0]
    (drone.home / "agent.toml").write_text(
        f'tower = "{address}"\ntoken = "{token}"\nautopilot = "udpin:127.0.0.1:{port}"\n'
        f'state = "{drone.home / "state"}"\n'
    )
    process = drone.start("agent", agent, "run", "--config", drone.home / "agent.toml")
    drone.find("agent", "(link up)")
    idle_kib = int(Path(f"/proc/{process.pid}/status").read_text().partition("VmRSS:")[2].split()[0])
    assert idle_kib < MAX_IDLE_KIB
    drone.start(
        "simulator",
        tower_programs / "tower-sim",
        *("--home", HOME),
        *("--boot-s", "1"),
        "--out",
        f"udp:127.0.0.1:{port}",
    )
    alice = Visitor(address).sign_in("alice")
    wait_for("the drone to be online", lambda: alice.drone(1).get("online"))

    async def fly() -> None:
        async with at_the_controls(alice, 1) as pilot:
            await pilot.take_off(3.0)
            assert pilot.armed

    asyncio.run(fly())
    process.send_signal(signal.SIGTERM)
    assert process.wait(10) == 0
    assert "Traceback" not in drone.said("agent")


def test_doctor_says_what_works_and_what_to_do(
    ground: Machine, address: str, tower_programs: Path, agent_programs: Path, drone: Machine
) -> None:
    token = drone.home / "token"
    ground.run(tower_programs / "tower", "drone", "add", "Merlin", "--token-file", token)
    agent, port = agent_programs / "tower-agent", free_udp_ports(1)[0]
    settings = ("--tower", address, "--token", token, "--autopilot", f"udpin:127.0.0.1:{port}", "--state", drone.home)
    before = drone.run(agent, "doctor", *settings, code=1)
    assert re.search(r"^!! key .* not enrolled yet\n +-> paste here the command", before, re.MULTILINE), before
    assert re.search(r"^!! autopilot .*\n +-> is it powered\?", before, re.MULTILINE), before
    out = ("--out", f"udp:127.0.0.1:{port}")
    drone.start("simulator", tower_programs / "tower-sim", "--home", HOME, "--boot-s", "1", *out)
    drone.run(agent, "enrol", address, token.read_text().strip(), "--token", token)
    found = drone.run(agent, "doctor", *settings, "--camera", "v4l2:/dev/video99", code=1)
    marks = {part: mark for mark, part in re.findall(r"^(ok|!!|--) (\S+)", found, re.MULTILINE)}
    working = dict.fromkeys(("settings", "key", "disk", "network", "clock", "sign-in", "UDP", "autopilot"), "ok")
    assert marks == {**working, "camera": "!!"}, found
    wheel = f"control_tower_agent-{VERSION}-py3-none-any.whl[video]"
    assert f"-> `{agent_programs}/pip install '{wheel}'`" in found


def test_install_writes_settings_key_and_unit(
    ground: Machine, address: str, tower_programs: Path, agent_programs: Path, drone: Machine
) -> None:
    token = drone.home / "one-time"
    ground.run(tower_programs / "tower", "drone", "add", "Osprey", "--token-file", token)
    agent, root = agent_programs / "tower-agent", drone.home / "root"
    words = ("--root", root, "--tower", address, "--autopilot", "serial:/dev/ttyAMA0:921600")
    said = drone.run(
        agent, "install", *words, "--uplink", "wlan0", "--uplink", "wwan0", "--enrol", token.read_text().strip()
    )
    assert "this is Osprey now" in said
    settings = tomllib.loads((root / "etc/tower-agent/agent.toml").read_text())
    assert settings == {"tower": address, "autopilot": "serial:/dev/ttyAMA0:921600", "uplinks": ["wlan0", "wwan0"]}
    key = root / "etc/tower-agent/token"
    assert key.read_text().startswith("twk_")
    assert key.stat().st_mode & 0o077 == 0
    unit = root / "etc/systemd/system/tower-agent.service"
    assert f"ExecStart={agent} run --token ${{CREDENTIALS_DIRECTORY}}/token" in unit.read_text()
    # Once more, with one other setting: the others and the key stay.
    again = drone.run(agent, "install", "--root", root, "--camera", "pi:0")
    assert f"key: {key}" in again
    assert tomllib.loads((root / "etc/tower-agent/agent.toml").read_text()) == {**settings, "camera": "pi:0"}
    if shutil.which("systemd-analyze"):
        verified = subprocess.run(
            ["systemd-analyze", "verify", str(unit)], capture_output=True, text=True, timeout=60, check=False
        )
        assert not [line for line in verified.stderr.splitlines() if "tower-agent" in line], verified.stderr


def test_the_base_agent_is_small_and_has_no_video(
    wheels: dict[str, Path], agent_programs: Path, drone: Machine
) -> None:
    names = {one.metadata["Name"].lower() for one in closure(wheels["control-tower-agent"])}
    assert names == {"cffi", "cryptography", "fastcrc", "msgspec", "pycparser", "pyserial", "uvloop", "websockets"}
    with_video = {one.metadata["Name"].lower() for one in closure(wheels["control-tower-agent"], "video")}
    assert with_video - names == {"av", "numpy", "opencv-python-headless"}
    files = [path for path in agent_programs.parent.rglob("*") if path.is_file() and not path.is_symlink()]
    assert sum(path.stat().st_size for path in files) < MAX_BASE_BYTES
    token = drone.home / "nothing"
    said = drone.run(
        agent_programs / "tower-agent",
        "run",
        "--tower",
        "http://127.0.0.1:9",
        "--token",
        token,
        "--autopilot",
        "udpin:127.0.0.1:0",
        "--camera",
        "pi:0",
        code=2,
    )
    assert f"no video: its libraries are not installed. `{agent_programs}/pip install 'control_tower_agent-" in said


@pytest.mark.parametrize(("package", "program"), [(TOWER, "tower"), (AGENT, "tower-agent")], ids=["tower", "agent"])
def test_a_package_for_debian_installs_runs_and_goes(
    wheels: dict[str, Path], space: Path, package: Package, program: str
) -> None:
    if shutil.which("dpkg-deb") is None or os.geteuid() != 0:
        pytest.skip("needs dpkg and root")
    asked = subprocess.run(["dpkg", "--print-architecture"], check=True, capture_output=True, text=True)
    folder = space / f"deb of {program}"
    folder.mkdir()
    deb = build_deb(
        package,
        version=VERSION,
        architecture=asked.stdout.strip(),
        python=PYTHON,
        work=folder,
        out=folder,
        compression="none",
        fill=lambda site: fill(site, wheels[package.name]),
    )
    root = folder / "root"
    script = Path(__file__).parents[2] / "deploy" / "packages" / "in_clean_root.sh"
    said = subprocess.run(
        ["bash", str(script), str(root), str(deb), program], capture_output=True, text=True, timeout=120, check=False
    )
    assert said.returncode == 0, said.stdout + said.stderr
    assert f"version {VERSION}" in said.stdout
    assert f"installed {debian_version(VERSION)}" in said.stdout
    assert "left behind: nothing" in said.stdout


def test_tower_connect_alone_watches_a_drone(
    ground: Machine, address: str, tower_programs: Path, space: Path, drone: Machine
) -> None:
    build = ("wheel", "-q", "--no-deps", "--no-build-isolation", "--no-index", "-w", str(space / "connect"))
    source = Path(__file__).parents[2] / "deploy" / "packages" / "connect"
    subprocess.run([sys.executable, "-m", "pip", *build, str(source)], check=True, timeout=90)
    [wheel] = (space / "connect").glob("control_tower_connect-*.whl")
    programs = install(space / "connect-alone", wheel)
    names = {one.metadata["Name"].lower() for one in closure(wheel)}
    assert not names & {"fastapi", "sqlalchemy", "pymavlink", "cryptography"}
    tower, token = tower_programs / "tower", drone.home / "token"
    ground.run(tower, "user", "add", "carol", "--password-stdin", "--for-good", stdin=PASSWORD)
    ground.run(tower, "drone", "add", "Harrier", "--owner", "carol", "--token-file", drone.home / "one-time")
    ground.run(tower, "token", "add", "carol", "station", "--scope", "watch", "--token-file", token)
    drone.start("connect", programs / "tower-connect", "harrier", "--tower", address, "--token-file", token)
    drone.find("connect", "(Harrier is at udp 127.0.0.1:14550: you watch)")
    refused = drone.run(programs / "tower-connect", "nobody", "--tower", address, "--token-file", token, code=2)
    assert refused.startswith("tower-connect: there is no drone nobody in your squad")
