"""Three drones of one system id through one `tower connect`: a ground station sees and flies three vehicles."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from test_connect import HEARTBEAT, NOT_IN_CONTROL, Program
from worlds.free_ports import free_udp_ports
from worlds.processes import World, wait_for
from worlds.stock_clients import MavProxy, installed

from wire.dialect import mavlink

NAMES = ("Kestrel", "Merlin", "Osprey")
AUTOPILOT, ALL, STATION = 1, 0, 255


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    folder = tmp_path_factory.mktemp("several")
    with World(folder) as world:
        world.add_user("alice")
        for name in NAMES:
            world.add_drone(name, "alice")
        world.start_tower()
        for number, (name, port) in enumerate(zip(NAMES, free_udp_ports(3), strict=True)):
            world.start_agent(name, f"udpin:127.0.0.1:{port}")
            home = f"47.39{number},8.5456,488,0"
            out = ("--out", f"udp:127.0.0.1:{port}", "--boot-s", "1")
            world.start(f"simulator of {name}", "tower-sim", "--home", home, *out)
        scopes = ("--scope", "watch", "--scope", "fly")
        world.tower_command("token", "add", "alice", "station", *scopes, "--token-file", str(folder / "token"))
        alice = world.visitor("alice")
        for number in range(1, 4):
            world.wait_until_online(alice, number)
        yield world


def connect(world: World, name: str, *options: str) -> str:
    """Returns its address."""
    words = ("--tower", world.address, "--token-file", str(world.folder / "token"), "--tcp", "127.0.0.1:0")
    process = world.start(name, "tower", "connect", *NAMES, *words, *options)

    def there() -> str | None:
        log = world.log_of(name)
        assert process.poll() is None, log
        places = re.findall(r"(\w+) is at (tcp \S+), as system (\d):", log)
        return places[0][1] if {one[0] for one in places} == set(NAMES) else None

    return wait_for("tower connect", there)


@pytest.fixture
def program(world: World) -> Iterator[Program]:
    program = Program(connect(world, "connect", "--fly"))
    yield program
    program.close()
    world.running("connect").terminate()
    assert world.running("connect").wait(20) == 0


def arm(system: int, *, is_on: bool = True) -> Any:
    return mavlink.MAVLink_command_long_message(system, 1, 400, 0, float(is_on), *[0.0] * 6)


def guided(system: int) -> Any:
    return mavlink.MAVLink_command_long_message(system, 1, 176, 0, 1, 4, *[0.0] * 5)


def beats_of(program: Program) -> set[int]:
    return {
        one.get_srcSystem()
        for one in program.listen()
        if one is not None and one.get_type() == "HEARTBEAT" and one.get_srcComponent() == AUTOPILOT
    }


def answers(program: Program, message: Any) -> set[tuple[int, int]]:
    """Systems and results of the answers to this program. Agents ask their autopilots, too."""
    program.messages.clear()
    asked = [0]

    def answered() -> set[tuple[int, int]] | None:
        if asked[0] % 50 == 0:
            program.say(HEARTBEAT)
            program.say(message)
        asked[0] += 1
        acks = [one for one in program.listen() if one is not None and one.get_type() == "COMMAND_ACK"]
        return {(one.get_srcSystem(), one.result) for one in acks if one.target_system == STATION} or None

    return wait_for("an answer", answered)


def test_each_is_a_system_of_its_own_and_gets_what_is_meant_for_it(world: World, program: Program) -> None:
    wait_for("three vehicles", lambda: beats_of(program) == {1, 2, 3})
    log = world.log_of("connect")
    for system, name in enumerate(NAMES, 1):
        assert re.search(rf"{name} is at tcp \S+, as system {system}: you {'fly' if system == 1 else 'watch'}", log)
    alice = world.visitor("alice")
    alice.accept_loss_check(1)

    # What is asked of one is answered by that one.
    for system in (1, 2, 3):
        version = mavlink.MAVLink_command_long_message(system, 1, 512, 0, 148, *[0.0] * 6)
        assert answers(program, version) == {(system, 0)}

    # Armed is the one that is flown, and no other.
    assert answers(program, arm(2)) == {(2, NOT_IN_CONTROL)}
    assert answers(program, guided(1)) == {(1, 0)}
    assert answers(program, arm(1)) == {(1, 0)}
    wait_for("Kestrel to be armed", lambda: alice.drone(1).get("armed"))
    assert [bool(alice.drone(number).get("armed")) for number in (1, 2, 3)] == [True, False, False]
    assert answers(program, arm(1, is_on=False)) == {(1, 0)}
    wait_for("Kestrel to be disarmed", lambda: not alice.drone(1).get("armed"))

    # Another one is flown after the first was released.
    alice.ask("POST", "/drones/1/control/release")
    alice.ask("POST", "/drones/3/control/acquire")
    alice.accept_loss_check(3)
    assert answers(program, guided(3)) == {(3, 0)}
    assert answers(program, arm(3)) == {(3, 0)}
    wait_for("Osprey to be armed", lambda: alice.drone(3).get("armed"))
    assert [bool(alice.drone(number).get("armed")) for number in (1, 2)] == [False, False]
    assert answers(program, arm(3, is_on=False)) == {(3, 0)}
    alice.ask("POST", "/drones/3/control/release")

    # A list of parameters that is asked of all comes from all.
    program.messages.clear()
    program.say(mavlink.MAVLink_param_request_list_message(ALL, ALL))

    def listed() -> set[int]:
        return {one.get_srcSystem() for one in program.listen() if one is not None and one.get_type() == "PARAM_VALUE"}

    wait_for("parameters of three", lambda: listed() == {1, 2, 3})


def test_one_that_is_named_twice_is_refused(world: World) -> None:
    words = ("--tower", world.address, "--token-file", str(world.folder / "token"))
    process = world.start("twice", "tower", "connect", "Kestrel", "1", *words)
    assert process.wait(20) == 2
    assert world.log_of("twice").strip() == "tower connect: Kestrel is named twice"


@pytest.mark.long("other people's ground stations")
def test_mavproxy_has_three_vehicles(world: World, tmp_path: Path, missing: Callable[[str], None]) -> None:
    if not installed():
        missing("MAVProxy and MAVSDK (deploy/install_test_parts.sh)")
    place = connect(world, "mavproxy's", "--fly")
    alice = world.visitor("alice")
    alice.accept_loss_check(1)
    proxy = MavProxy(place.replace("tcp ", "tcp:"), tmp_path)
    try:
        for number in (1, 2, 3):
            proxy.until(rf"(?i)detected vehicle {number}:1")
        proxy.type("vehicle 1")
        proxy.type("mode guided")
        proxy.until("(?<!DIS)ARMED", again="arm throttle")
        wait_for("Kestrel to be armed", lambda: alice.drone(1).get("armed"))
        assert [bool(alice.drone(number).get("armed")) for number in (2, 3)] == [False, False]
        proxy.until("DISARMED", again="disarm")
    finally:
        proxy.close()
        world.running("mavproxy's").terminate()
        world.running("mavproxy's").wait(20)
