"""`tower connect` as a process before a real tower: who may fly through it, how it reconnects, and how it ends."""

import contextlib
import http.server
import os
import pty
import re
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from worlds.processes import BIN, PASSWORD, World, free_udp_ports, kill_9, wait_for

from wire.dialect import build, decode, mavlink
from wire.frame_stream import FrameStream

NOT_IN_CONTROL = 10
HEARTBEAT = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
ASK_VERSION = mavlink.MAVLink_command_long_message(1, 1, 512, 0, 148, *[0.0] * 6)
"""A message that only reads."""
FLIES = mavlink.MAVLink_command_long_message(1, 1, 178, 0, 0, 3.0, *[0.0] * 5)
"""DO_CHANGE_SPEED: harmless, but reserved for the holder."""


class Program:
    """The parts of a ground station that these tests need, on a TCP or UDP port."""

    def __init__(self, place: str) -> None:
        kind, _, address = place.partition(" ")
        host, _, port = address.rpartition(":")
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM if kind == "tcp" else socket.SOCK_DGRAM)
        self._socket.settimeout(0.02)
        self._socket.connect((host, int(port)))
        self._stream = FrameStream()
        self.messages: list[Any] = []
        self.frames: list[bytes] = []
        """As received."""

    def say(self, message: Any) -> None:
        self._socket.send(build(message, system_id=255, component_id=190, sequence=0))

    def listen(self) -> list[Any]:
        with contextlib.suppress(TimeoutError, ConnectionError):
            frames = self._stream.feed(self._socket.recv(65536))
            self.frames += frames
            self.messages += map(decode, frames)
        return self.messages

    def has(self, kind: str, **fields: Any) -> bool:
        return any(
            message is not None
            and message.get_type() == kind
            and all(getattr(message, name) == value for name, value in fields.items())
            for message in self.listen()
        )

    def answer_to(self, message: Any) -> int:
        """Returns the result in the COMMAND_ACK. Repeats the message until one arrives."""
        said_at = [0]

        def answered() -> int | None:
            if said_at[0] % 50 == 0:
                self.say(HEARTBEAT)
                self.say(message)
            said_at[0] += 1
            acks = [m for m in self.listen() if m is not None and m.get_type() == "COMMAND_ACK"]
            return next((ack.result + 1 for ack in acks if ack.command == message.command), None)

        self.messages.clear()
        return wait_for("an answer", answered) - 1

    def close(self) -> None:
        self._socket.close()


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("connect")
    with World(folder) as world:
        world.add_user("alice")
        world.add_user("root", "admin")
        world.add_drone("Kestrel", "alice")
        scopes = ("--scope", "watch", "--scope", "fly")
        world.tower_command("token", "add", "alice", "flies", *scopes, "--token-file", str(folder / "token"))
        world.tower_command("token", "add", "alice", "looks", "--scope", "watch", "--token-file", str(folder / "looks"))
    return folder


@contextlib.contextmanager
def kestrel_on_the_ground(folder: Path, template: Path) -> Iterator[World]:
    """A simulated Kestrel of alice."""
    for file in template.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    with World(folder, prepared=True) as world:
        world.start_tower()
        world.start_simulated("Kestrel", options=("--boot-s", "1"))
        world.wait_until_online(world.visitor("alice"), 1)
        yield world


@pytest.fixture
def world(tmp_path: Path, template: Path) -> Iterator[World]:
    with kestrel_on_the_ground(tmp_path, template) as world:
        yield world


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory, template: Path) -> Iterator[World]:
    """For tests that leave it as they found it."""
    with kestrel_on_the_ground(tmp_path_factory.mktemp("shared"), template) as world:
        yield world


@pytest.fixture
def programs() -> Iterator[Callable[[str], Program]]:
    opened: list[Program] = []

    def open_(place: str) -> Program:
        opened.append(Program(place))
        return opened[-1]

    yield open_
    for program in opened:
        program.close()


def connect(world: World, *options: str, token: str = "token", name: str = "connect") -> str:
    """Starts `tower connect` and waits until it listens. Returns its address."""
    where = ("--tower", world.address, "--token-file", str(world.folder / token))
    process = world.start(name, "tower", "connect", "kestrel", *where, *options)

    def there() -> str | None:
        assert process.poll() is None, world.log_of(name)
        found = re.search(r"Kestrel is at (.*): you (?:fly|watch)\n", world.log_of(name))
        return found[1] if found and "Kestrel is online" in world.log_of(name) else None

    return wait_for("tower connect", there)


def said(world: World, words: str, name: str = "connect") -> None:
    wait_for(f"tower connect to say {words!r}", lambda: words in world.log_of(name))


def failed(world: World, *arguments: str, code: int, **environment: str) -> str:
    """Runs it to its end. Asserts this exit code and a single line of output, and returns the line."""
    done = subprocess.run(
        [str(BIN / "tower"), "connect", *arguments],
        env={**world.environment, **environment},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == code, (done.stdout, done.stderr)
    assert done.stderr.startswith("tower connect: ")
    assert done.stderr.count("\n") == 1, done.stderr
    return done.stderr


def test_a_watcher_sees_all_and_flies_nothing(world: World, programs: Callable[[str], Program]) -> None:
    alice = world.visitor("alice")
    assert alice.ask("POST", "/drones/1/control/acquire").status == 200  # from another window of the same person
    places = connect(world, "--tcp", "127.0.0.1:0", "--udp-listen", "127.0.0.1:0").split(", ")
    assert sorted(place.split()[0] for place in places) == ["tcp", "udp"]
    for place in places:
        program = programs(place)
        assert program.answer_to(ASK_VERSION) == mavlink.MAV_RESULT_ACCEPTED
        wait_for("telemetry", lambda program=program: program.has("ATTITUDE") and program.has("AUTOPILOT_VERSION"))
        assert program.answer_to(FLIES) == NOT_IN_CONTROL
    said(world, "You do not have the controls of Kestrel")
    world.running("connect").terminate()
    assert world.running("connect").wait(10) == 0
    assert alice.drone(1)["holder"]["name"] == "alice", "what was not ours is not released"


def test_a_holder_flies_until_an_admin_takes_it_and_again_after_accepting(
    world: World, programs: Callable[[str], Program]
) -> None:
    program = programs(connect(world, "--fly", "--tcp", "127.0.0.1:0"))
    said(world, "you have the controls of Kestrel")
    assert program.answer_to(FLIES) == mavlink.MAV_RESULT_ACCEPTED
    root = world.visitor("root")
    assert root.ask("POST", "/drones/1/control/take", {"reason": "gusts"}).status == 200
    program.messages.clear()
    program.say(FLIES)
    wait_for("a refusal", lambda: program.has("COMMAND_ACK", command=178, result=NOT_IN_CONTROL))
    said(world, "root took control: gusts")
    said(world, "you do NOT have the controls of Kestrel")
    root.ask("POST", "/drones/1/control/give")
    said(world, "type accept and press Enter")
    assert world.visitor("alice").ask("POST", "/drones/1/control/accept", {"sticks_centred": True}).status == 200
    said(world, "alice accepted the controls")
    assert program.answer_to(FLIES) == mavlink.MAV_RESULT_ACCEPTED
    world.running("connect").terminate()
    assert world.running("connect").wait(10) == 0
    assert "the controls of Kestrel are released" in world.log_of("connect")
    assert world.visitor("root").drone(1)["holder"] is None


def test_what_is_typed_changes_hands(shared: World) -> None:
    port = free_udp_ports(1)[0]
    process = subprocess.Popen(
        [str(BIN / "tower"), "connect", "1", "--tower", shared.address, "--fly", "--udp", f"127.0.0.1:{port}"],
        env={**shared.environment, "TOWER_TOKEN_FILE": str(shared.folder / "token")},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        for typed, wanted in (
            ("", "you have the controls of Kestrel"),
            ("release\n", "you do NOT have the controls"),
            ("help\n", "type acquire, release or accept"),
            ("accept\n", "nobody has offered you these controls"),
            ("acquire\n", "you have the controls of Kestrel"),
        ):
            process.stdin.write(typed)
            process.stdin.flush()
            while wanted not in (line := process.stdout.readline()):
                assert line, f"it ended instead of saying {wanted!r}"
    finally:
        process.terminate()
        process.communicate(timeout=10)
    assert process.returncode == 0


def test_a_silent_ground_station_is_a_pilot_who_is_gone(world: World, programs: Callable[[str], Program]) -> None:
    program = programs(connect(world, "--fly", "--tcp", "127.0.0.1:0"))
    assert program.answer_to(FLIES) == mavlink.MAV_RESULT_ACCEPTED
    program.close()
    said(world, "no ground station is heard: the pilot is gone")
    address = re.search(r"tcp \S+:\d+", world.log_of("connect"))
    assert address is not None
    again = programs(address[0])
    again.say(HEARTBEAT)
    said(world, "a ground station is there again")
    wait_for("the controls", lambda: again.answer_to(FLIES) == mavlink.MAV_RESULT_ACCEPTED)
    assert world.visitor("root").drone(1)["holder"]["name"] == "alice"


def test_it_is_back_by_itself_after_the_tower_was(world: World, programs: Callable[[str], Program]) -> None:
    program = programs(connect(world, "--fly", "--tcp", "127.0.0.1:0"))
    assert program.answer_to(FLIES) == mavlink.MAV_RESULT_ACCEPTED
    kill_9(world.tower)
    said(world, "is lost")
    program.say(FLIES)
    said(world, "the tower is out of reach: what a program sent was dropped")
    world.start_tower()
    said(world, f"connected with {world.address} again")
    wait_for("the controls", lambda: program.answer_to(FLIES) == mavlink.MAV_RESULT_ACCEPTED)


def test_a_revoked_token_ends_it(world: World) -> None:
    connect(world, "--tcp", "127.0.0.1:0", token="looks")
    world.tower_command("token", "revoke", "2")
    assert world.running("connect").wait(10) == 2
    assert world.log_of("connect").splitlines()[-1].startswith(f"tower connect: {world.address} refuses: this token is")


def test_a_new_password_ends_a_token_that_is_not_kept(world: World) -> None:
    connect(world, "--fly", "--tcp", "127.0.0.1:0")
    alice = world.visitor("alice")
    for old, new, keeps in ((PASSWORD, "another fine staple", True), ("another fine staple", PASSWORD, False)):
        assert alice.drone(1)["holder"]["name"] == "alice"
        assert world.running("connect").poll() is None
        words = {"old_password": old, "new_password": new, "keep_tokens": keeps}
        answer = alice.ask("POST", "/me/password", words)
        assert answer.status == 200, answer.body
    assert world.running("connect").wait(20) == 2
    assert world.log_of("connect").splitlines()[-1].startswith(f"tower connect: {world.address} refuses: this token is")
    assert alice.drone(1)["holder"] is None


def test_the_loss_check_is_read_out_and_asked_for_on_a_terminal(world: World) -> None:
    alice = world.visitor("alice")
    world.running("simulator").terminate()
    words = world.running("simulator").args
    assert isinstance(words, list | tuple)
    # The boot clock may be too low to show a restart; the silence shows that this is another autopilot.
    wait_for("silence", lambda: not alice.drone(1)["autopilot_heard"])
    world.start("simulator-2", "tower-sim", *words[1:], "--param", "RC_OVERRIDE_TIME=-1")
    wait_for("the danger", lambda: alice.ask("GET", "/drones/1/loss-check").json["dangerous"])
    ask = ("Kestrel", "--tower", world.address, "--fly", "--acknowledge-loss-check", "--tcp", "127.0.0.1:0")
    token = {"TOWER_TOKEN_FILE": str(world.folder / "token")}
    assert "needs the drone's name, typed" in failed(world, *ask, code=1, **token)
    assert alice.drone(1)["holder"] is None, "what was acquired is released"

    ours, theirs = pty.openpty()
    log = world.folder / "asked.log"
    with log.open("wb") as out:
        command = [str(BIN / "tower"), "connect", *ask]
        environment = {**world.environment, **token}
        process = subprocess.Popen(command, stdin=theirs, stdout=out, stderr=subprocess.STDOUT, env=environment)
    os.close(theirs)
    try:
        wait_for("the question", lambda: "Type the drone's name, Kestrel, if you know this" in log.read_text())
        assert "danger: if the operator is lost: RC_OVERRIDE_TIME is -1" in log.read_text()
        assert not alice.ask("GET", "/drones/1/loss-check").json["acknowledged"]
        os.write(ours, b"Kestrel\n")
        wait_for("the name", lambda: alice.ask("GET", "/drones/1/loss-check").json["acknowledged"])
    finally:
        process.terminate()
        status = process.wait(10)
        os.close(ours)
    assert status == 0


def test_the_token_goes_to_nobody_else(shared: World) -> None:
    heard: list[str] = []

    class Elsewhere(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            heard.append(self.path)
            self.send_response(302)
            self.send_header("Location", "/elsewhere")
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Elsewhere) as server:
        serving = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05})
        serving.start()
        address = f"http://127.0.0.1:{server.server_port}"
        where = ("--tower", address, "--token-file", str(shared.folder / "token"), "--tcp", "127.0.0.1:0")
        try:
            assert "refuses: HTTP status 302" in failed(shared, "Kestrel", *where, code=2)
        finally:
            server.shutdown()
            serving.join()
    assert heard == ["/api/v1/drones"]


def test_mistakes_are_one_line(shared: World) -> None:
    good = ("--tower", shared.address, "--token-file", str(shared.folder / "token"))
    bad = {"TOWER_TOKEN": "twt_" + "x" * 43}
    local = ("--tcp", "127.0.0.1:0")
    assert "there is no drone Osprey in your squad; there is Kestrel (1)" in failed(shared, "Osprey", *good, code=2)
    assert "this token is not valid" in failed(shared, "Kestrel", "--tower", shared.address, *local, code=2, **bad)
    assert "an API token is needed" in failed(shared, "Kestrel", "--tower", shared.address, code=2)
    assert "cannot be read" in failed(shared, "Kestrel", *good[:2], "--token-file", "/nowhere/token", code=2)
    assert "plain http" in failed(shared, "Kestrel", "--tower", "http://tower.example", *good[2:], code=2)
    assert "HOST:PORT" in failed(shared, "Kestrel", *good, "--udp", "14550", code=2)
    assert "--other-machines" in failed(shared, "Kestrel", *good, "--tcp", "0.0.0.0:0", code=2)
    looks = ("--tower", shared.address, "--token-file", str(shared.folder / "looks"), *local)
    assert "lacks the scope fly" in failed(shared, "Kestrel", *looks, "--fly", code=1)
    unreachable = ("--tower", f"http://127.0.0.1:{free_udp_ports(1)[0]}", *good[2:])
    assert "cannot be reached" in failed(shared, "Kestrel", *unreachable, *local, code=1)
    assert "goes with --fly" in failed(shared, "Kestrel", *good, "--acknowledge-loss-check", code=2)
    root = shared.visitor("root")
    root.ask("POST", "/drones/1/control/acquire")
    assert "somebody else has the controls" in failed(shared, "Kestrel", *good, *local, "--fly", code=1)
    assert root.ask("POST", "/drones/1/control/release").status == 200


@pytest.mark.parametrize(("option", "kind"), [("--tcp", socket.SOCK_STREAM), ("--udp-listen", socket.SOCK_DGRAM)])
def test_a_port_in_use_is_named(shared: World, option: str, kind: socket.SocketKind) -> None:
    good = ("--tower", shared.address, "--token-file", str(shared.folder / "token"))
    with socket.socket(socket.AF_INET, kind) as taken:
        taken.bind(("127.0.0.1", 0))
        if kind is socket.SOCK_STREAM:
            taken.listen()
        place = f"127.0.0.1:{taken.getsockname()[1]}"
        assert f"{place} is in use by another program" in failed(shared, "Kestrel", *good, option, place, code=2)


def test_it_starts_without_a_database() -> None:
    """`tower connect` must not import packages that only a tower needs."""
    code = (
        "import sys; sys.argv = ['tower', 'connect', '--help']\n"
        "from server.app.entry import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print(sorted({'sqlalchemy', 'fastapi', 'passlib', 'uvicorn'} & set(sys.modules)))"
    )
    done = subprocess.run([str(BIN / "python"), "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
