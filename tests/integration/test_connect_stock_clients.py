"""Real third-party clients fly the simulator through the whole product: tower, agent, `tower connect`."""

import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from worlds.processes import CHECKOUT, World, free_udp_ports, wait_for
from worlds.stock_clients import CLIENTS, ENVIRONMENT, MavProxy, installed

pytestmark = pytest.mark.long("other people's ground stations")

SPEED = "4"
PARAMETERS = "1500"
MISSION = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t47.3977\t8.5456\t488\t1
1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t12\t1
2\t0\t3\t16\t0\t0\t0\t0\t47.3979\t8.5456\t12\t1
3\t0\t3\t16\t0\t0\t0\t0\t47.3979\t8.5458\t14\t1
4\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""


@pytest.fixture
def world(tmp_path: Path, missing: Callable[[str], None]) -> Iterator[World]:
    """alice's Kestrel, simulated and ready, and a token of hers."""
    if not installed():
        missing("MAVProxy and MAVSDK (deploy/install_test_parts.sh)")
    with World(tmp_path) as world:
        world.add_user("alice")
        world.add_drone("Kestrel", "alice")
        world.start_tower()
        world.start_simulated("Kestrel", options=("--boot-s", "4", "--speed", SPEED, "--param-count", PARAMETERS))
        scopes = ("--scope", "watch", "--scope", "fly")
        world.tower_command("token", "add", "alice", "ground station", *scopes, "--token-file", str(tmp_path / "token"))
        world.wait_until_online(world.visitor("alice"), 1)
        yield world


def connect(world: World, *options: str) -> str:
    """Starts `tower connect --fly` and waits until it listens. Returns its address."""
    token = ("--tower", world.address, "--token-file", str(world.folder / "token"))
    process = world.start("connect", "tower", "connect", "Kestrel", *token, "--fly", *options)

    def there() -> str | None:
        assert process.poll() is None, world.log_of("connect")
        found = re.search(r"Kestrel is at (.*): you fly", world.log_of("connect"))
        return found[1] if found and "you have the controls" in world.log_of("connect") else None

    place = wait_for("tower connect to fly", there)
    world.visitor("alice").accept_loss_check(1)
    return place


def coordinates(waypoints: str) -> list[tuple[float, ...]]:
    """Returns command, latitude, longitude and altitude of each line of a waypoint file, without home."""
    rows = [line.split() for line in waypoints.splitlines()[2:]]
    return [(float(row[3]), float(row[8]), float(row[9]), float(row[10])) for row in rows]


def test_mavsdk_flies(world: World) -> None:
    """The program listens on a UDP port, as MAVSDK does by default."""
    port, grpc_port = free_udp_ports(2)
    connect(world, "--udp", f"127.0.0.1:{port}")
    flight = subprocess.run(
        [sys.executable, str(CHECKOUT / "tests/worlds/mavsdk_flight.py"), f"udpin://127.0.0.1:{port}", str(grpc_port)],
        env=ENVIRONMENT,
        cwd=world.folder,
        capture_output=True,
        text=True,
        timeout=150,
        check=False,
    )
    assert flight.returncode == 0, (flight.stdout, flight.stderr[-2000:], world.log_of("connect"))
    steps = [line.split(maxsplit=1)[1] for line in flight.stdout.splitlines()]
    assert steps == [
        "connected",
        f"parameters {PARAMETERS}",
        "parameter set",
        "mission uploaded 60",
        "mission downloaded 60",
        "ready",
        "armed",
        "taken off",
        "gone to",
        "returning",
        "returned and disarmed",
    ]


def test_mavproxy_flies(world: World) -> None:
    """Over TCP, with commands typed by a person."""
    place = connect(world, "--tcp", "127.0.0.1:0")
    assert CLIENTS.is_dir()
    (world.folder / "there.txt").write_text(MISSION)
    proxy = MavProxy(place.replace("tcp ", "tcp:"), world.folder)
    try:
        proxy.until(f"Received {PARAMETERS} parameters")
        proxy.type("wp load there.txt")
        proxy.until("MISSION_ACK: TYPE_MISSION: ACCEPTED")
        proxy.type("wp save back.txt")
        proxy.until("Saved 5 waypoints")
        assert coordinates((world.folder / "back.txt").read_text()) == coordinates(MISSION)
        proxy.type("param set WPNAV_SPEED 640")
        proxy.until(r"WPNAV_SPEED\s+640", again="param show WPNAV_SPEED")
        proxy.type("mode guided")
        proxy.until("Mode GUIDED")
        proxy.until("(?<!DIS)ARMED", again="arm throttle")
        proxy.type("takeoff 8")
        proxy.until("NAV_TAKEOFF: ACCEPTED")
        proxy.until(r"relative_alt : [78]\d\d\d\b", again="status GLOBAL_POSITION_INT")
        proxy.type("guided 47.3978 8.5456 11")
        proxy.until("DO_REPOSITION: ACCEPTED")
        proxy.until(r"lat : 47397(79[5-9]|80[0-5])\d,", again="status GLOBAL_POSITION_INT")
        proxy.type("mode rtl")
        proxy.until("Mode RTL")
        proxy.until("DISARMED")
    finally:
        proxy.close()
