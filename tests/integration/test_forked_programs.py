"""A forked program behaves as one that was started: its words, exit code, environment, signals and processes."""

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from worlds.forked_programs import ForkedProgram, Forker, fork, run_forked
from worlds.free_ports import free_udp_ports
from worlds.processes import BIN, World, wait_for

ENDS_WITHIN_S = 30.0


@pytest.fixture(scope="module")
def forker() -> Iterator[Forker]:
    """A forker of the tower, with a setting in its own environment that no tower accepts."""
    with pytest.MonkeyPatch.context() as its_environment:
        its_environment.setenv("TOWER_PORT", "of the forker")
        made = Forker("tower")
    yield made
    made.stop()


def run(forker: Forker, folder: Path, *words: str, **environment: str) -> tuple[int, str]:
    """Returns the exit code and all output."""
    kept: Mapping[str, str] = {name: value for name, value in os.environ.items() if not name.startswith("TOWER_")}
    log_file = folder / "log"
    with log_file.open("wb") as log, Path(os.devnull).open("rb") as nothing:
        given = {**kept, "TOWER_VAR": str(folder), **environment}
        program = forker.start([str(BIN / "tower"), *words], given, (nothing, log, log))
    return program.wait(ENDS_WITHIN_S), log_file.read_text()


def test_it_has_the_arguments_and_the_environment_it_was_given(forker: Forker, tmp_path: Path) -> None:
    assert run(forker, tmp_path, "migrate")[0] == 0
    assert (tmp_path / "tower.sqlite3").exists()
    code, words = run(forker, tmp_path, "migrate", TOWER_PORT="of the program")
    assert (code, "TOWER_PORT" in words, "of the forker" in words) == (2, True, False), words
    assert run(forker, tmp_path, "no-such-command")[0] == 2


def test_no_two_programs_share_random_numbers(forker: Forker, tmp_path: Path) -> None:
    keys = {run(forker, tmp_path, "new-key")[1] for _ in range(2)}
    assert len(keys) == 2, keys


def test_programs_started_at_the_same_time_are_not_confused(forker: Forker, tmp_path: Path) -> None:
    def code_of(number: int) -> int:
        folder = tmp_path / str(number)
        folder.mkdir()
        return run(forker, folder, "new-key" if number % 2 else "no-such-command")[0]

    with ThreadPoolExecutor(4) as threads:
        assert list(threads.map(code_of, range(4))) == [2, 0] * 2


def test_each_is_a_process_that_signals_end(tmp_path: Path) -> None:
    with World(tmp_path) as world:
        (port,) = free_udp_ports(1)
        command = ("tower-sim", "--home", "47.3977,8.5456,488,0", "--boot-s", "1", "--out", f"udp:127.0.0.1:{port}")
        flying = [world.start(f"sim-{one}", *command) for one in range(3)]
        assert all(isinstance(one, ForkedProgram) for one in flying)
        assert len({one.pid for one in flying}) == 3
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ears:
            ears.settimeout(ENDS_WITHIN_S)
            ears.bind(("127.0.0.1", port))
            heard: set[int] = set()

            def all_fly() -> bool:
                heard.add(ears.recvfrom(500)[1][1])
                return len(heard) == 3

            wait_for("telemetry of all three", all_fly)
        codes = []
        for one, number in zip(flying, (signal.SIGTERM, signal.SIGINT, signal.SIGKILL), strict=True):
            assert one.poll() is None
            one.send_signal(number)
            codes.append(one.wait(ENDS_WITHIN_S))
        assert codes == [0, 0, -signal.SIGKILL]


def test_it_reads_its_input_and_keeps_output_and_errors_apart(tmp_path: Path) -> None:
    command = str(BIN / "tower")
    given = {**os.environ, "TOWER_VAR": str(tmp_path)}
    assert run_forked([command, "migrate"], given, b"")[0] == 0
    add = [command, "user", "add", "Anna", "--password-stdin"]
    code, out, err = run_forked(add, given, b"short\n")
    assert (code, out, b"a password needs at least 12 characters" in err) == (1, b"", True), err
    code, out, err = run_forked(add, given, b"four words are longer\n")
    assert (code, b"Anna" in out, err) == (0, True, b""), err


def test_the_installed_scripts_of_others_are_not_forked(tmp_path: Path) -> None:
    with (tmp_path / "log").open("wb") as log:
        assert fork([str(BIN / "python"), "--version"], log, os.environ) is None
        assert fork([str(BIN / "tower"), "connect", "--help"], log, os.environ) is None
        assert fork(["/usr/bin/tower", "serve"], log, os.environ) is None


def test_a_forker_with_a_second_thread_refuses(tmp_path: Path) -> None:
    script = (
        "import socket, sys, threading; sys.path.insert(0, 'tests')\n"
        "from worlds.program_forker import Forker\n"
        "threading.Thread(target=threading.Event().wait, daemon=True).start()\n"
        "Forker(socket.socket()).next_child()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "an import started 1 threads" in done.stderr
