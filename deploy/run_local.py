"""`make run`: a tower with a simulated squad on this machine, each drone behind a real agent process.

It only starts programs and monitors them: `tower`, `tower-sim` and one `tower-agent` per drone, which communicate as
they would in the field. Ctrl-C ends everything it started. `$TOWER_VAR/squad.json` keeps its state between runs (names,
and the first passwords until they are changed, readable only by you).
"""

import os
import secrets
import signal
import socket
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path
from typing import Final, NoReturn

sys.path.insert(0, str(Path(__file__).parent))

from painted_field import HOME, agent_words, simulator_words
from squad import BIN, Squad, accounts_now
from supervised import Program, ProgramFailed, StepFailed, end_all, run_once

OPERATORS: Final = ("alice", "bob")
DRONE_NAMES: Final = ("Kestrel", "Merlin", "Osprey", "Harrier", "Goshawk", "Hobby", "Buzzard", "Falcon")
SET_UP: Final = ("--param", "FS_GCS_ENABLE=1", "--param", "FS_OPTIONS=2")
"""As the console sets a drone up: if its agent fails, it returns."""
SHELL: Final = "simulator.sock"
"""Of `tower-sim shell --attach`, in the folder of the tower."""
MAX_SOCKET_PATH: Final = 100
"""Bytes; no system takes fewer."""
MAX_SENSING: Final = 100
"""Drones that fly on sensors and a filter without being asked to: so many take less than a core, as measured."""
MODELS: Final = ("sensing", "exact")
READY_WITHIN_S: Final = 60.0
LAND_WITHIN_S: Final = 20.0
"""Waits this long for the land at the first run; later it appears when the console looks for it again."""
CHECK_PASSWORDS_EVERY_S: Final = 300.0
"""Maximum time that a changed first password stays in `squad.json`: each check starts a program."""


class CannotRun(Exception):
    """The user has to change something. One clear line."""


def say(text: str) -> None:
    """Prints progress, in the same format as the Makefile."""
    print(f"\033[1m==>\033[0m {text}" if sys.stdout.isatty() else f"==> {text}", flush=True)


def whole_number(variable: str, default: int, *, least: int, most: int) -> int:
    """Reads an environment variable as a number in a range. Raises CannotRun naming the variable."""
    text = os.environ.get(variable, "").strip() or str(default)
    if not text.isdecimal() or not least <= int(text) <= most:
        raise CannotRun(f"{variable} must be a whole number from {least} to {most}")
    return int(text)


def check_port(kind: socket.SocketKind, host: str, port: int, variable: str) -> None:
    """Raises CannotRun if the port is not free now."""
    what = "TCP" if kind is socket.SOCK_STREAM else "UDP"
    with socket.socket(socket.AF_INET, kind) as probe:
        if kind is socket.SOCK_STREAM:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            raise CannotRun(
                f"{what} port {port} cannot be used on {host} ({error.strerror}). "
                f"End what uses it, or choose another port: {variable}={port + 1} make run"
            ) from None


def free_ports(kind: socket.SocketKind, count: int) -> list[int]:
    """Returns ports that the kernel reports as free now; agents and simulator take them a moment later."""
    probes = [socket.socket(socket.AF_INET, kind) for _ in range(count)]
    try:
        for probe in probes:
            probe.bind(("127.0.0.1", 0))
        return [probe.getsockname()[1] for probe in probes]
    finally:
        for probe in probes:
            probe.close()


def drone_name(number: int) -> str:
    """Returns birds of prey first, then numbers."""
    return DRONE_NAMES[number] if number < len(DRONE_NAMES) else f"Drone {number + 1}"


def prepare(var: Path, count: int) -> tuple[Squad, list[str]]:
    """Prepares database, accounts and drones. Returns the squad and the drones of this run."""
    say("Preparing the database")
    run_once(BIN / "tower", "migrate")
    squad = Squad(var)
    if "admin" not in squad.accounts:
        say("Making the first accounts")
    chosen = os.environ.get("TOWER_ADMIN_PASSWORD", "")
    wanted = {"admin": ("admin", chosen or secrets.token_urlsafe(12), bool(chosen))}
    wanted |= {operator: ("operator", secrets.token_urlsafe(12), False) for operator in OPERATORS}
    squad.add_users(wanted)
    names = [drone_name(number) for number in range(count)]
    # The two operators share the drones: the first half and the rest.
    for number, name in enumerate(names):
        squad.add_drone(name, OPERATORS[0] if number < (count + 1) // 2 else OPERATORS[1])
    return squad, names


def wait_for_tower(tower: Program, address: str) -> None:
    """Waits until the tower answers. Raises ProgramFailed if it ends instead."""
    deadline = time.monotonic() + READY_WITHIN_S
    while time.monotonic() < deadline:
        tower.check()
        try:
            with urllib.request.urlopen(f"{address}/api/v1/health", timeout=1) as answer:
                if answer.status == 200:
                    return
        except (urllib.error.URLError, OSError):
            time.sleep(0.1)
    raise ProgramFailed(tower, "it did not answer in time")


def draw_land(maps: Path, log: Path) -> Program:
    """Draws the land that the cameras see as map files, beside everything else. Later runs find them there."""
    land = Program(
        "map of the simulated land",
        [sys.executable, "-m", "simulator.land_map", "--home", HOME, "--hills", "--out", maps],
        log / "land.log",
    )
    land.start()
    return land


def flight_model(count: int) -> str:
    """Reads SQUAD_MODEL, how `tower-sim` models a drone; by default as well as this machine can. Raises CannotRun."""
    model = os.environ.get("SQUAD_MODEL", "").strip() or MODELS[0 if count <= MAX_SENSING else 1]
    if model not in MODELS:
        raise CannotRun(f"SQUAD_MODEL must be one of {', '.join(MODELS)}")
    return model


def shell_words(path: Path) -> tuple[str | Path, ...]:
    """Returns the options for a terminal at the simulator, and for its commander."""
    return ("--shell", path) if len(os.fsencode(path)) <= MAX_SOCKET_PATH else ("--commander",)


def start_squad(address: str, squad: Squad, names: list[str], model: str, log: Path) -> list[Program]:
    """Starts the agents, then the simulator whose vehicles and cameras they use."""
    ports = free_ports(socket.SOCK_DGRAM, len(names))
    camera_ports = free_ports(socket.SOCK_STREAM, len(names))
    started: list[Program] = []
    for number, (name, port, camera_port) in enumerate(zip(names, ports, camera_ports, strict=True)):
        agent = Program(
            f"agent of {name}",
            [
                *(BIN / "tower-agent", "run", "--tower", address, "--token", squad.token_file(name)),
                *("--autopilot", f"udpin:127.0.0.1:{port}", "--state", log.parent / "agents"),
                *agent_words(number, name, camera_port),
            ],
            log / f"agent-{squad.token_file(name).stem}.log",
        )
        agent.start()
        started.append(agent)
    outs = [word for port in ports for word in ("--out", f"udp:127.0.0.1:{port}")]
    cameras = [word for port in camera_ports for word in ("--camera", str(port))]
    simulator = Program(
        "simulator",
        [
            *(BIN / "tower-sim", "--count", str(len(names)), "--home", HOME, "--hills", "--model", model),
            *(*SET_UP, *simulator_words(), *shell_words(log.parent / SHELL), *outs, *cameras),
        ],
        log / "simulator.log",
    )
    simulator.start()
    return [*started, simulator]


def print_welcome(address: str, squad: Squad, names: list[str], *, first: bool) -> None:
    """Prints the address, and who may sign in."""
    owned = {
        operator: ", ".join(name for name in names if squad.drones[name] == operator) or "no drone in this run"
        for operator in OPERATORS
    }
    print(f"\n  Control Tower is running at  {address}\n")
    accounts = accounts_now()
    squad.forget_changed_passwords(accounts)
    print("  First passwords, to be changed at the first sign-in:" if first else "  Accounts:")
    for user in squad.accounts:
        password = squad.first_passwords.get(user, "(changed since)")
        flies = "sees and may take every drone" if user == "admin" else f"owns {owned[user]}"
        if user not in accounts:
            password, flies = "(deleted since)", ""
        print(f"    {user:<8} {password:<24} {flies}".rstrip())
    if not first:
        print("  Forgotten: .venv/bin/tower user password NAME")
    chosen = os.environ.get("TOWER_ADMIN_PASSWORD", "")
    if chosen and chosen != squad.first_passwords.get("admin"):
        print("  TOWER_ADMIN_PASSWORD is only used at the first run; now: .venv/bin/tower user password admin")
    print("\n  Ctrl-C ends it all.\n", flush=True)


def run() -> None:
    """Runs from the first check to Ctrl-C."""
    count = whole_number("SQUAD", 3, least=0, most=200)
    model = flight_model(count)
    port = whole_number("TOWER_PORT", 8000, least=1, most=65535)
    udp_port = whole_number("TOWER_UDP_PORT", 14650, least=1, most=65535)
    host = os.environ.get("TOWER_HOST", "").strip() or "127.0.0.1"
    check_port(socket.SOCK_STREAM, host, port, "TOWER_PORT")
    check_port(socket.SOCK_DGRAM, host, udp_port, "TOWER_UDP_PORT")
    var = Path(os.environ.get("TOWER_VAR", "").strip() or "var").absolute()
    log = var / "log"
    try:
        var.mkdir(mode=0o700, parents=True, exist_ok=True)
        log.mkdir(exist_ok=True)
    except OSError as error:
        raise CannotRun(f"TOWER_VAR: {var} cannot be made ({error.strerror})") from None
    os.environ["TOWER_VAR"] = str(var)
    maps = Path(os.environ.get("TOWER_MAPS", "").strip() or var / "maps").absolute()
    first = not (var / "squad.json").exists()
    shown = "127.0.0.1" if host in ("0.0.0.0", "::") else host
    address = f"http://{shown}:{port}"
    programs: list[Program] = []
    land = draw_land(maps, log) if count else None
    try:
        squad, names = prepare(var, count)
        say("Starting the tower")
        tower = Program("tower", [BIN / "tower", "serve"], log / "tower.log")
        programs.append(tower)
        tower.start()
        wait_for_tower(tower, address)
        if names:
            say(f"Starting {len(names)} simulated drone{'s' if len(names) > 1 else ''}, each behind its own agent")
            programs += start_squad(address, squad, names, model, log)
        if land is not None:
            land.ends_within(LAND_WITHIN_S)
        print_welcome(address, squad, names, first=first)
        check_at = time.monotonic() + CHECK_PASSWORDS_EVERY_S
        while True:
            time.sleep(0.2)
            for program in programs:
                program.keep_alive(say)
            if squad.first_passwords and time.monotonic() >= check_at:
                squad.forget_changed_passwords(accounts_now())
                check_at = time.monotonic() + CHECK_PASSWORDS_EVERY_S
    finally:
        end_all([*programs, land] if land is not None else programs)


def stop(*_: object) -> NoReturn:
    """SIGTERM and SIGHUP end it as Ctrl-C does."""
    raise KeyboardInterrupt


def main() -> int:
    """Returns the exit code: 0 after Ctrl-C, 1 if something failed, 2 if something has to be changed first."""
    # SIGINT too: otherwise it is ignored if a script starts this in the background.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, stop)
    try:
        run()
    except KeyboardInterrupt:
        print("\nEverything has been ended.", flush=True)
        return 0
    except CannotRun as error:
        print(f"Cannot start: {error}", file=sys.stderr)
        return 2
    except (ProgramFailed, StepFailed) as error:
        print(f"\n{error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
