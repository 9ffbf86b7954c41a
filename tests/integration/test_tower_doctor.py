"""`tower doctor` on installations that are broken in one way each, and on one that is not."""

from __future__ import annotations

import os
import re
import socket
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding
from typer.testing import CliRunner
from worlds.free_ports import free_tcp_port, free_udp_ports
from worlds.processes import World

from server.app.cli import app
from server.runtime.vault import new_key


@dataclass
class Place:
    """An installation. `stack`: what is open during the examination."""

    folder: Path
    environment: dict[str, str]
    stack: ExitStack = field(default_factory=ExitStack)

    @property
    def database(self) -> Path:
        return self.folder / "tower.sqlite3"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of a tower, which is not running."""
    folder = tmp_path_factory.mktemp("whole")
    with World(folder):
        pass
    (folder / "secret.key").write_text(new_key())
    return folder


@pytest.fixture
def place(tmp_path: Path, whole: Path) -> Iterator[Place]:
    for path in whole.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    [udp_port] = free_udp_ports(1)
    environment = {
        "TOWER_VAR": str(tmp_path),
        "TOWER_PORT": str(free_tcp_port()),
        "TOWER_UDP_PORT": str(udp_port),
        "TOWER_DISK_LOW_MB": "0",
    }
    with ExitStack() as stack:
        yield Place(tmp_path, environment, stack)


def examined(place: Place) -> tuple[int, dict[str, tuple[str, str]]]:
    """The exit code, and of each part its mark and its words."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("TOWER_", "DATABASE_URL"))}
    done = CliRunner().invoke(
        app, ["doctor"], env={**dict.fromkeys(os.environ.keys() - kept.keys()), **place.environment}
    )
    lines = re.findall(r"^(ok|!!|--) (\S+) +(.*)\n(?: +-> (.*)\n)?", done.output, re.MULTILINE)
    return done.exit_code, {part: (mark, f"{found} -> {remedy}") for mark, part, found, remedy in lines}


def test_a_whole_installation(place: Place) -> None:
    code, found = examined(place)
    marks = {part: mark for part, (mark, _) in found.items()}
    sound = dict.fromkeys(("settings", "database", "keys", "disk", "port", "UDP"), "ok")
    assert marks == {**sound, "address": "--", "clock": marks["clock"], "certificate": "--", "bus": "--"}
    assert code == (1 if marks["clock"] == "!!" else 0)


def misspelt(place: Place) -> None:
    place.environment["TOWER_UDP_PRT"] = "1"


def damaged(place: Place) -> None:
    """The first page of a table: elsewhere the bytes may be ones that nothing uses."""
    with closing(sqlite3.connect(place.database)) as connection:
        (page_bytes,) = connection.execute("PRAGMA page_size").fetchone()
        (page,) = connection.execute("SELECT rootpage FROM sqlite_master WHERE name = 'users'").fetchone()
    with place.database.open("r+b") as file:
        file.seek((page - 1) * page_bytes)
        file.write(os.urandom(2000))


def no_database(place: Place) -> None:
    place.database.unlink()


def an_older_one(place: Place) -> None:
    with closing(sqlite3.connect(place.database)) as connection, connection:
        connection.execute("UPDATE alembic_version SET version_num = '0001'")


def a_newer_one(place: Place) -> None:
    with closing(sqlite3.connect(place.database)) as connection, connection:
        connection.execute("UPDATE alembic_version SET version_num = '9999'")


def no_postgres(place: Place) -> None:
    place.environment["DATABASE_URL"] = f"postgresql://tower:secret@127.0.0.1:{free_tcp_port()}/tower"


def no_key(place: Place) -> None:
    (place.folder / "secret.key").unlink()


def a_broken_key(place: Place) -> None:
    (place.folder / "secret.key").write_text("half a k")


def no_room(place: Place) -> None:
    place.environment["TOWER_DISK_LOW_MB"] = "999999999"


def port_taken(place: Place) -> None:
    # Bound, and nobody answers there.
    held = place.stack.enter_context(socket.socket())
    held.bind(("127.0.0.1", 0))
    place.environment["TOWER_PORT"] = str(held.getsockname()[1])


def udp_taken(place: Place) -> None:
    other = place.stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    other.bind(("127.0.0.1", 0))
    place.environment["TOWER_UDP_PORT"] = str(other.getsockname()[1])


def udp_on_loopback(place: Place) -> None:
    place.environment["TOWER_PUBLIC_URL"] = "https://tower.invalid"


def unknown_name(place: Place) -> None:
    place.environment["TOWER_PUBLIC_URL"] = "https://tower.invalid"


def nothing_at_the_address(place: Place) -> None:
    place.environment["TOWER_PUBLIC_URL"] = f"http://127.0.0.1:{free_tcp_port()}"


def a_certificate(place: Place, ends_in_days: int) -> None:
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "tower")])
    now = datetime.now(UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now - timedelta(days=100))
        .not_valid_after(now + timedelta(days=ends_in_days, minutes=5))
        .sign(key, hashes.SHA256())
    )
    file = place.folder / "tower.pem"
    file.write_bytes(made.public_bytes(Encoding.PEM))
    place.environment["TOWER_TLS_CERTIFICATE"] = str(file)


def an_old_certificate(place: Place) -> None:
    a_certificate(place, -3)


def one_that_ends_soon(place: Place) -> None:
    a_certificate(place, 5)


def no_certificate(place: Place) -> None:
    place.environment["TOWER_TLS_CERTIFICATE"] = str(place.folder / "nothing.pem")


def no_bus(place: Place) -> None:
    place.environment["DATABASE_URL"] = f"postgresql://tower:secret@127.0.0.1:{free_tcp_port()}/tower"
    place.environment["TOWER_BUS_URL"] = f"nats://127.0.0.1:{free_tcp_port()}"


BROKEN: list[tuple[Callable[[Place], None], str, str, str]] = [
    (misspelt, "settings", "!!", r"TOWER_UDP_PRT is not a setting of the tower: did you mean TOWER_UDP_PORT\?"),
    (damaged, "database", "!!", r"is damaged: .* -> restore a backup"),
    (no_database, "database", "--", r"there is no .*tower.sqlite3 -> `tower serve` makes it"),
    (an_older_one, "database", "!!", r"is at revision 0001 and has to be at \d+: run `tower migrate`"),
    (a_newer_one, "database", "!!", r"a newer version of the tower made"),
    (no_postgres, "database", "!!", r"cannot be reached"),
    (no_key, "keys", "!!", r"there is no file .*secret.key -> restore it from the backup"),
    (a_broken_key, "keys", "!!", r"must hold keys as `tower new-key` prints them"),
    (no_room, "disk", "!!", r"\d+ MB are free for .* -> delete recordings"),
    (port_taken, "port", "!!", r"port \d+ on 127.0.0.1 is in use: set TOWER_PORT"),
    (udp_taken, "UDP", "!!", r"port \d+ on 127.0.0.1 is in use: set TOWER_UDP_PORT"),
    (udp_on_loopback, "UDP", "!!", r"agents elsewhere cannot reach 127.0.0.1: .* -> set TOWER_UDP_HOST=0.0.0.0"),
    (unknown_name, "address", "!!", r"tower.invalid: the name is not known -> give tower.invalid an address"),
    (nothing_at_the_address, "address", "!!", r"Connection refused -> start proxy and tower"),
    (an_old_certificate, "certificate", "!!", r"ended \d days ago -> renew it"),
    (one_that_ends_soon, "certificate", "!!", r"ends in 5 days"),
    (no_certificate, "certificate", "!!", r"nothing.pem: No such file or directory -> name the file"),
    (no_bus, "bus", "!!", r"127.0.0.1:\d+: Connection refused -> start NATS"),
]


@pytest.mark.parametrize(("break_it", "part", "mark", "words"), BROKEN, ids=[one[0].__name__ for one in BROKEN])
def test_what_is_broken_is_named_with_what_to_do(
    place: Place, break_it: Callable[[Place], None], part: str, mark: str, words: str
) -> None:
    break_it(place)
    code, found = examined(place)
    assert found[part][0] == mark, found
    assert re.search(words, found[part][1]), found[part]
    assert code == (1 if any(one == "!!" for one, _ in found.values()) else 0)


def test_it_runs_beside_a_tower(tmp_path: Path) -> None:
    with World(tmp_path) as world:
        world.start_tower()
        place = Place(tmp_path, {name: value for name, value in world.environment.items() if name.startswith("TOWER_")})
        place.environment |= {"TOWER_DISK_LOW_MB": "0", "TOWER_PUBLIC_URL": world.address}
        _, found = examined(place)
        assert found["port"] == ("ok", f"a tower serves port {world.port} here -> ")
        assert found["address"] == ("ok", f"a tower answers at {world.address} -> ")
        assert found["database"][0] == found["UDP"][0] == "ok", found
