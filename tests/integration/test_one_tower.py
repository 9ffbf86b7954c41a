"""Never two towers on a database: real processes that are refused, wait, die and are stopped."""

import asyncio
import os
import re
import signal
import sqlite3
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from tcp_switch import TcpSwitch
from worlds.free_ports import free_tcp_port, free_udp_ports
from worlds.pilot import at_the_controls, fly_by_hand
from worlds.processes import BIN, CHECKOUT, DATABASE, Process, Visitor, World, kill_9, wait_for

TAKES_OVER_WITHIN_S = 60.0
"""On a machine whose cores are all busy."""
SIMULATOR = ("--boot-s", "1", "--seed", "3", "--speed", "1", "--radio", "low")


class Pair:
    """A tower, a standby, and a switch in front of them that a person operates."""

    def __init__(self, world: World) -> None:
        self.world = world
        world.add_user("alice")
        world.add_user("admin", "admin")
        assert world.add_drone("Kestrel", "alice") == 1
        self.first = world.start_tower()
        self.first_port = world.port
        self.switch = TcpSwitch(self.first_port)
        world.port = self.switch.port  # the port for agents and people from here on
        self.second_port = free_tcp_port()
        self.second = self._stand_by()

    def _stand_by(self) -> Process:
        world = self.world
        changed = {"TOWER_PORT": str(self.second_port), "TOWER_UDP_PORT": str(free_udp_ports(1)[0])}
        process = world._spawn("standby", str(BIN / "tower"), "serve", "--standby", env=world.environment | changed)
        wait_for("the standby", lambda: "stands by" in world.log_of("standby"))
        return process

    def health(self, what: str = "/health") -> tuple[int, Any]:
        try:
            answer = Visitor(f"http://127.0.0.1:{self.second_port}").ask("GET", what)
        except OSError:
            return 0, None  # between the two
        return answer.status, answer.json

    def stop_first(self) -> float:
        """Stops the tower with SIGSTOP between two transactions, and returns when.

        In the middle of one it would keep SQLite's write lock, and nobody could take over (ADR 11).
        """
        while True:
            self.first.send_signal(signal.SIGSTOP)
            stopped_at = time.monotonic()
            database = sqlite3.connect(self.world.folder / DATABASE, timeout=0.5, isolation_level=None)
            try:
                database.execute("BEGIN IMMEDIATE")
                database.execute("ROLLBACK")
                return stopped_at
            except sqlite3.OperationalError:
                self.first.send_signal(signal.SIGCONT)
            finally:
                database.close()

    def until_taken_over(self, since: float) -> float:
        """Returns the seconds from `since` until the second one reports that it is the tower."""
        wait_for("the second tower", lambda: self.health()[1] and self.health()[1]["status"] == "ok", timeout_s=20)
        return time.monotonic() - since


@pytest.fixture
def pair(tmp_path: Path) -> Iterator[Pair]:
    with World(tmp_path / "world") as world:
        made = Pair(world)
        try:
            yield made
        finally:
            if made.first.poll() is None:
                made.first.send_signal(signal.SIGCONT)
            made.switch.close()


def test_a_second_tower_says_who_has_the_database_and_ends(tmp_path: Path) -> None:
    with World(tmp_path / "world") as world:
        world.add_user("admin", "admin")
        first = world.start_tower()
        other = world.environment | {"TOWER_PORT": "0", "TOWER_UDP_PORT": "0"}
        second = subprocess.run(
            [BIN / "tower", "serve"], env=other, cwd=CHECKOUT, capture_output=True, text=True, timeout=60, check=False
        )
        assert second.returncode == 1
        said = second.stderr.strip().splitlines()[-1]
        assert said.startswith("tower: another tower serves this database: "), second.stderr
        assert f"process {first.pid} on " in said
        assert world.address in said
        assert re.search(r"since \d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC", said)
        assert "--standby" in said
        assert "Traceback" not in second.stderr
        world.add_user("ben")  # commands still work beside it
        assert world.visitor("admin").ask("GET", "/me").status == 200
        # The successor starts at once after a kill, because the kernel has released the life file's lock.
        kill_9(first)
        world.start_tower()
        assert not [one for one in world.folder.glob("*.tower-*") if str(first.pid) in one.name]
        assert len(list(world.folder.glob("*.sqlite3.tower-*"))) == 1


async def test_the_standby_takes_over_from_a_tower_that_was_killed(pair: Pair) -> None:
    world = pair.world
    status, said = await asyncio.to_thread(pair.health)
    assert (status, said["status"]) == (200, "standby")
    assert (await asyncio.to_thread(pair.health, "/health/ready"))[0] == 503
    assert (await asyncio.to_thread(pair.health, "/drones"))[0] == 503
    await asyncio.to_thread(world.start_simulated, "Kestrel", options=SIMULATOR)
    await asyncio.to_thread(world.wait_until_online, world.visitor("admin"), 1)
    alice = world.visitor("alice")
    async with at_the_controls(alice, 1) as pilot:
        await fly_by_hand(pilot)
        epoch = (await asyncio.to_thread(alice.drone, 1))["epoch"]
        await asyncio.to_thread(kill_9, pair.first)
        killed_at = time.monotonic()
        pair.switch.turn_to(pair.second_port)
    took_s = await asyncio.to_thread(pair.until_taken_over, killed_at)
    print(f"taken over after {took_s:.2f} s")
    assert took_s < TAKES_OVER_WITHIN_S
    await asyncio.to_thread(world.wait_until_online, world.visitor("admin"), 1)
    assert "hold: confirmed" in world.log_of("agent-Kestrel")
    drone = await asyncio.to_thread(alice.drone, 1)
    assert (drone["holder"]["name"], drone["epoch"]) == ("alice", epoch)
    assert not list(world.folder.glob("*.tower-*"))[1:]


async def test_a_tower_that_was_stopped_and_goes_on_is_no_tower_any_more(pair: Pair) -> None:
    world = pair.world
    await asyncio.to_thread(world.start_simulated, "Kestrel", options=SIMULATOR)
    await asyncio.to_thread(world.wait_until_online, world.visitor("admin"), 1)
    alice = world.visitor("alice")
    async with at_the_controls(alice, 1) as pilot:
        await fly_by_hand(pilot)
        stopped_at = await asyncio.to_thread(pair.stop_first)
        pair.switch.turn_to(pair.second_port)
        # Her sticks still go to the sockets of the stopped tower: `pilot` sends them all the while.
        took_s = await asyncio.to_thread(pair.until_taken_over, stopped_at)
        print(f"taken over after {took_s:.2f} s")
        assert took_s < TAKES_OVER_WITHIN_S
        admin = world.visitor("admin")
        await asyncio.to_thread(world.wait_until_online, admin, 1)
        assert (await asyncio.to_thread(admin.ask, "POST", "/drones/1/control/take", {})).status == 200
        taken = await asyncio.to_thread(admin.drone, 1)
        pair.first.send_signal(signal.SIGCONT)
        code = await asyncio.to_thread(pair.first.wait, 30)
    assert code == 1
    last = world.log_of("tower-1").strip().splitlines()[-1]
    assert last.startswith("tower: another process has become the tower of this database: process "), last
    assert f"process {pair.second.pid} on " in last
    now = await asyncio.to_thread(admin.drone, 1)
    assert (now["holder"]["name"], now["epoch"], now["online"]) == ("admin", taken["epoch"], True)


def _until(condition: Callable[[], Any], what: str) -> None:
    wait_for(what, condition, timeout_s=10)


def test_the_life_file_dies_with_its_process(tmp_path: Path) -> None:
    from server.runtime.life_file import has_died

    path = tmp_path / "life"
    assert not has_died(path), "nothing is known of a file that is not there"
    code = (
        "import sys, pathlib; from server.runtime.life_file import LifeFile;"
        "one = LifeFile(pathlib.Path(sys.argv[1])); one.lock(); print('locked', flush=True); sys.stdin.read()"
    )
    process = subprocess.Popen(
        ["python3" if not (BIN / "python").exists() else str(BIN / "python"), "-c", code, str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        cwd=CHECKOUT,
        env=os.environ | {"PYTHONPATH": str(CHECKOUT)},
    )
    assert process.stdout is not None
    assert process.stdin is not None
    with process.stdout, process.stdin:
        assert process.stdout.readline() == b"locked\n"
        assert not has_died(path)
        process.send_signal(signal.SIGSTOP)
        assert not has_died(path), "who is stopped is not dead"
        kill_9(process)
        _until(lambda: has_died(path), "the kernel to free it")
