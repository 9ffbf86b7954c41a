"""Tower processes on one PostgreSQL and one NATS, with one drone; the fixture that makes them."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from own_postgres import own_postgres
from worlds.free_ports import free_tcp_port, free_udp_ports
from worlds.nats import nats_program, temporary_nats
from worlds.processes import BIN, Process, Visitor, World, wait_for


@dataclass
class SharedWorld(World):
    """Towers on one PostgreSQL and one NATS. Agents come through a switch, as through a proxy."""

    shared: dict[str, str] = field(default_factory=dict)
    ports: list[int] = field(default_factory=list)

    @property
    def environment(self) -> dict[str, str]:
        return super().environment | self.shared

    def start_one(self, port: int = 0) -> Process:
        """Starts another tower."""
        port = port or free_tcp_port()
        self.ports.append(port)
        name = f"tower-{len(self.ports)}"
        changed = {
            "TOWER_PORT": str(port),
            "TOWER_UDP_PORT": str(free_udp_ports(1)[0]),
            "TOWER_OWN_URL": f"http://127.0.0.1:{port}",
        }
        process = self._spawn(name, str(BIN / "tower"), "serve", env=self.environment | changed)

        def listens() -> bool:
            assert process.poll() is None, self.log_of(name)
            return re.search(rf"http://127\.0\.0\.1:{port}\b", self.log_of(name)) is not None

        wait_for(f"{name} to listen", listens)
        return process

    def at(self, number: int, name: str) -> Visitor:
        return Visitor(f"http://127.0.0.1:{self.ports[number]}").sign_in(name)


@pytest.fixture
def world(tmp_path: Path, missing: Callable[[str], None]) -> Iterator[SharedWorld]:
    program = nats_program()
    if program is None:
        missing("NATS (Debian: apt-get install nats-server)")
    assert program is not None
    with own_postgres(missing) as postgres, temporary_nats(program) as nats:
        folder = tmp_path / "world"
        folder.mkdir(mode=0o700)
        shared = {
            "DATABASE_URL": postgres.url,
            "TOWER_BUS_URL": nats.url,
            "TOWER_WEBHOOKS_MAY_BE_PRIVATE": "yes",
        }
        with SharedWorld(folder, prepared=True, shared=shared) as made:
            made.tower_command("migrate")
            made.add_user("alice")
            made.add_user("admin", "admin")
            assert made.add_drone("Kestrel", "alice") == 1
            yield made
