"""A world of real programs: `tower`, `tower-agent` and `tower-sim` as processes, on their own ports.

Each test has its own folder with its own database, credentials and logs. Every wait is for a condition with a deadline.
"""

import atexit
import http.cookiejar
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeVar

from typer.testing import CliRunner
from worlds.forked_programs import ForkedProgram, fork
from worlds.free_ports import free_tcp_port, free_udp_ports

from onboard_agent.link.enrolment import enrol
from onboard_agent.link.identity_file import read_identity
from onboard_agent.link.tower_url import parse_tower_url
from wire.drone_key import DroneKey

BIN: Final = Path(sys.executable).parent
CHECKOUT: Final = Path(__file__).resolve().parents[2]
PASSWORD: Final = "correct horse battery"
DATABASE: Final = "tower.sqlite3"
DEADLINE_S: Final = 60.0

Process = ForkedProgram | subprocess.Popen[bytes]
Found = TypeVar("Found")


def wait_for(
    what: str, look: Callable[[], Found | None], *, timeout_s: float = DEADLINE_S, every_s: float = 0.02
) -> Found:
    """Polls `look` and returns its first result that is not None or False. Fails naming `what` after the deadline."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        found = look()
        if found is not None and found is not False:
            return found
        time.sleep(every_s)
    raise AssertionError(f"waited {timeout_s:g} s in vain for {what}")


@dataclass
class Answer:
    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


class Visitor:
    """A client with a cookie jar for the tower's REST API."""

    def __init__(self, address: str) -> None:
        self.address = address
        self._cookies = http.cookiejar.CookieJar()
        self._opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(self._cookies))

    def ask(self, method: str, path: str, body: Any = None, **headers: str) -> Answer:
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.address + "/api/v1" + path, data=data, method=method)
        if data is not None:
            request.add_header("Content-Type", "application/json")
        for name, value in headers.items():
            request.add_header(name, value)
        try:
            with self._opener.open(request, timeout=10) as answer:
                return Answer(answer.status, dict(answer.headers), answer.read())
        except urllib.error.HTTPError as error:
            with error:
                return Answer(error.code, dict(error.headers), error.read())

    def fetch(self, path: str) -> Answer:
        """Returns a page or a file of the console."""
        with self._opener.open(self.address + path, timeout=10) as answer:
            return Answer(answer.status, dict(answer.headers), answer.read())

    def sign_in(self, name: str, password: str = PASSWORD) -> "Visitor":
        answer = self.ask("POST", "/session", {"name": name, "password": password})
        assert answer.status == 200, answer.body
        return self

    def drone(self, drone_id: int) -> Any:
        return self.ask("GET", f"/drones/{drone_id}").json

    def accept_loss_check(self, drone_id: int) -> None:
        """Waits until the agent has read the parameters, and acknowledges what a loss would do: a drone as it comes is
        in danger if its computer fails."""
        path = f"/drones/{drone_id}/loss-check"

        def accepted() -> bool:
            check = self.ask("GET", path).json
            if not check["complete"] or check["has_radio"] is None:
                return False
            if not check["dangerous"] or check["acknowledged"]:
                return True
            self.ask("POST", f"{path}/acknowledge", {"drone": self.drone(drone_id)["name"]})
            return False

        wait_for("the check before flight", accepted)

    @property
    def cookie(self) -> str:
        return "; ".join(f"{one.name}={one.value}" for one in self._cookies)


@dataclass
class World:
    """Programs in one folder. A context manager: on exit it ends every program by its own pid."""

    folder: Path
    prepared: bool = False
    """Whether the folder already holds a database."""
    as_installed: bool = False
    """Starts the installed console scripts, each in a new interpreter, and forks none (`worlds.program_forker`)."""
    port: int = 0
    udp_port: int = 0
    cameras: dict[str, int] = field(default_factory=dict)
    """The camera port of each drone."""
    tower: Process = field(init=False)
    """The newest tower process."""
    _running: list[Process] = field(default_factory=list)
    _started: dict[str, tuple[Process, tuple[str, ...]]] = field(default_factory=dict)
    _logs: int = 0

    def __enter__(self) -> "World":
        if not self.prepared:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            shutil.copyfile(_migrated(), self.folder / DATABASE)
        return self

    def __exit__(self, *_: object) -> None:
        for process in reversed(self._running):
            if process.poll() is None:
                process.terminate()
        for process in reversed(self._running):
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    @property
    def environment(self) -> dict[str, str]:
        return {
            **os.environ,
            "TOWER_VAR": str(self.folder),
            "TOWER_AGENT_STATE": str(self.folder / "agents"),
            "TOWER_PORT": str(self.port),
            "TOWER_UDP_PORT": str(self.udp_port),
            "TOWER_ARGON2_MEMORY_KIB": "19456",
            "TOWER_ARGON2_ROUNDS": "2",
            "TOWER_ARGON2_PROCESS": "no",  # it takes longer to start than all hashes of a test take
            "TOWER_DATABASE_TIMEOUT_S": "20",  # a machine and a disk that other tests keep busy
        }

    def tower_command(self, *words: str, stdin: str = "") -> str:
        return _tower(words, self.environment, stdin)

    def add_user(self, name: str, role: str = "operator") -> None:
        self.tower_command("user", "add", name, "--role", role, "--password-stdin", "--for-good", stdin=PASSWORD)

    def add_drone(self, name: str, *owners: str) -> int:
        owned = [word for owner in owners for word in ("--owner", owner)]
        said = self.tower_command("drone", "add", name, *owned, "--token-file", str(self.token_file(name)))
        found = re.search(r"\(id (\d+)\)", said)
        assert found, said
        return int(found[1])

    def token_file(self, drone: str) -> Path:
        return self.folder / f"{drone}.token"

    def enrolled(self, drone: str) -> DroneKey:
        """Returns the drone's key, for a test that plays its agent."""
        path = self.token_file(drone)
        enrol(parse_tower_url(self.address), path.read_text().strip(), path)
        key = read_identity(path).key
        assert key is not None
        return key

    def log_of(self, name: str) -> str:
        return (self.folder / f"{name}.log").read_text(errors="replace")

    def start(self, name: str, *command: str) -> Process:
        """Starts a program of this checkout by its name."""
        process = self._spawn(name, str(BIN / command[0]), *command[1:], env=self.environment)
        self._started[name] = (process, command)
        return process

    def paste(self, name: str, line: str, **environment: str) -> Process:
        """Runs a command line in a shell that finds our programs, as a user pastes it."""
        path = f"{BIN}{os.pathsep}{os.environ['PATH']}"
        return self._spawn(name, "bash", "-c", line, env={**self.environment, "PATH": path, **environment})

    def install_agent(self, name: str, line: str, root: Path) -> Process:
        """Pastes an enrolment's command, below `root`, and starts the agent as the unit does."""
        assert self.paste(f"{name}, installed", f"{line} --root {root}").wait(30) == 0, self.log_of(
            f"{name}, installed"
        )
        settings = root / "etc" / "tower-agent"
        state = root / "var" / "lib" / "tower-agent"
        words = ("--config", str(settings / "agent.toml"), "--token", str(settings / "token"), "--state", str(state))
        return self.start(name, "tower-agent", "run", *words)

    def _spawn(self, name: str, *command: str, env: dict[str, str]) -> Process:
        with (self.folder / f"{name}.log").open("ab") as log:
            process: Process | None = None if self.as_installed else fork(command, log, env)
            if process is None:
                process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, env=env, cwd=CHECKOUT
                )
        self._running.append(process)
        return process

    def running(self, name: str) -> Process:
        """Returns the newest process of this name."""
        return self._started[name][0]

    def restart(self, name: str) -> Process:
        """Starts the same command again, as systemd would."""
        return self.start(name, *self._started[name][1])

    def start_tower(self) -> Process:
        """Starts the tower and waits until it responds. A start after a kill uses the same port again."""
        self._logs += 1
        # The port stays reserved for this world: it is outside the ephemeral range, so nobody gets it while the tower
        # is down.
        self.port = self.port or free_tcp_port()
        self.udp_port = self.udp_port or free_udp_ports(1)[0]
        name = f"tower-{self._logs}"
        process = self.start(name, "tower", "serve")

        def listening() -> int | None:
            assert process.poll() is None, self.log_of(name)
            found = re.search(r"http://127\.0\.0\.1:(\d+)", self.log_of(name))
            return int(found[1]) if found else None

        self.port = wait_for("the tower to listen", listening)
        self.tower = process
        return process

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def start_agent(self, drone: str, autopilot: str, *options: str, program: str = "tower-agent") -> Process:
        """`program`: of this checkout, or the path of another agent."""
        token = str(self.token_file(drone))
        where = ("--tower", self.address, "--token", token, "--autopilot", autopilot)
        return self.start(f"agent-{drone}", program, "run", *where, *options)

    def start_simulated(
        self, *drones: str, options: tuple[str, ...] = (), camera: str = "", agent: str = "tower-agent"
    ) -> None:
        """Starts an agent for each drone and one simulator that flies them all. `camera`: each drone has a camera at
        its port in `cameras`, and the agent requests such pictures (`width=320&height=240&rate=15`). `agent`: its
        program."""
        ports = free_udp_ports(len(drones))
        self.cameras = {drone: free_tcp_port() for drone in drones} if camera else {}
        for drone, port in zip(drones, ports, strict=True):
            self.start_agent(drone, f"udpin:127.0.0.1:{port}", *self.look_through(drone, camera), program=agent)
        outs = [word for port in ports for word in ("--out", f"udp:127.0.0.1:{port}")]
        outs += [word for port in self.cameras.values() for word in ("--camera", str(port))]
        home = ("--home", "47.3977,8.5456,488,0")
        self.start("simulator", "tower-sim", "--count", str(len(drones)), *home, *outs, *options)

    def look_through(self, drone: str, camera: str) -> tuple[str, ...]:
        """Returns the agent's arguments for a drone with a camera."""
        port = self.cameras.get(drone)
        return () if port is None else ("--camera", f"http://127.0.0.1:{port}/camera?{camera}")

    def unplug_camera(self, drone: str, seconds: float) -> None:
        """Unplugs the camera now, for this many simulated seconds."""
        address = f"http://127.0.0.1:{self.cameras[drone]}/unplug?seconds={seconds:g}"
        with urllib.request.urlopen(urllib.request.Request(address, method="POST"), timeout=10) as answer:
            assert answer.status < 300

    def visitor(self, name: str) -> Visitor:
        return Visitor(self.address).sign_in(name)

    def wait_until_online(self, visitor: Visitor, *drone_ids: int, timeout_s: float = DEADLINE_S) -> None:
        wait_for(
            f"drones {drone_ids} to be online",
            lambda: all(visitor.drone(drone_id).get("online") for drone_id in drone_ids),
            timeout_s=timeout_s,
            every_s=0.1,  # each look is a request to the tower
        )


def _tower(words: Sequence[str], environment: Mapping[str, str], stdin: str = "") -> str:
    """Returns the output of `tower WORDS`, without a process of its own, which would take over a second of CPU time.
    `test_server_cli.py` tests the real process. Runs in a thread, because the caller may be in an event loop."""
    from server.app.cli import app

    with ThreadPoolExecutor(1) as thread:
        done = thread.submit(CliRunner().invoke, app, words, input=stdin, env=environment).result()
    assert done.exit_code == 0, done.output or repr(done.exception)
    return done.stdout


@cache
def _migrated() -> Path:
    """Returns an empty database of the newest revision, made once in each process that runs tests."""
    folder = Path(tempfile.mkdtemp(prefix="tower-migrated-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    _tower(["migrate"], {**os.environ, "TOWER_VAR": str(folder)})
    return folder / DATABASE


def kill_9(process: Process) -> None:
    """Kills a process as the kernel does when memory runs out: without a clean shutdown."""
    process.send_signal(signal.SIGKILL)
    process.wait()
