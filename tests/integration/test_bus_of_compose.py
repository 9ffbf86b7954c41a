"""deploy/nats.conf, as docker-compose.yml runs it, with a real NATS: TLS, one user, and no subject but the towers'."""

import asyncio
import json
import ssl
import stat
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

import pytest
from control_world import until
from nats.aio.client import Client
from own_postgres import OwnPostgres, own_postgres
from tower_world import start_tower
from worlds.free_ports import free_tcp_port
from worlds.nats import nats_program, temporary_nats

from server.app.commands.towers import bus_certificate
from server.kernel.clock import utc_now
from server.runtime.vault import new_key
from server.towers.api import nats_bus
from server.towers.api.nats_bus import NatsBus
from server.towers.io.bus_certificate import AUTHORITY, CERTIFICATE, KEY, RENEWED_BEFORE, VALID_FOR, is_valid
from server.towers.io.bus_unavailable import BusUnavailable

CONFIGURATION = Path(__file__).parents[2] / "deploy" / "nats.conf"
NAMES = ["bus", "127.0.0.1"]
PASSWORD = "8e71c0ffee"
"""What `openssl rand -hex` may make: without quotation marks NATS would read a number, and refuse its own file."""


@dataclass
class Bus:
    folder: Path
    address: str
    health: str

    @property
    def authority(self) -> Path:
        return self.folder / AUTHORITY

    def url(self, user: str = f"tower:{PASSWORD}@", scheme: str = "tls") -> str:
        return f"{scheme}://{user}{self.address}"


A, B = "0a" * 16, "0b" * 16


def keys() -> list[bytes]:
    return [b"k" * 32]


@pytest.fixture
def bus(tmp_path: Path, missing: Callable[[str], None]) -> Iterator[Bus]:
    program = nats_program()
    if program is None:
        missing("NATS (Debian: apt-get install nats-server)")
    assert program is not None
    folder = tmp_path / "bus"
    bus_certificate(folder, NAMES)
    port = free_tcp_port()
    options = ("--config", str(CONFIGURATION), "--http_port", str(port))
    with temporary_nats(program, *options, folder=folder, environment={"BUS_PASSWORD": f'"{PASSWORD}"'}) as nats:
        yield Bus(folder, nats.url.removeprefix("nats://"), f"http://127.0.0.1:{port}/healthz")


async def opened(bus: Bus, me: str, packets: list[bytes]) -> NatsBus:
    one = NatsBus(bus.url(), me, on_packet=packets.append, keys=keys, authority=bus.authority)
    await one.open()
    return one


async def test_towers_hear_each_other_and_it_is_healthy(bus: Bus) -> None:
    packets: list[bytes] = []
    a, b = await opened(bus, A, []), await opened(bus, B, packets)
    try:
        largest = b"x" * 900_000
        a.publish(B, b"order")
        a.publish(B, largest)
        await until("both packets", lambda: packets == [b"order", largest])
    finally:
        await a.close()
        await b.close()

    def status() -> str:
        with urllib.request.urlopen(bus.health, timeout=10) as answer:
            return str(json.load(answer)["status"])

    assert await asyncio.to_thread(status) == "ok"


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nats_bus, "OPEN_WITHIN_S", 2.0)


@pytest.mark.parametrize("user", ["", "tower:wrong@", f"root:{PASSWORD}@"])
async def test_nobody_else_comes_in(bus: Bus, user: str) -> None:
    stranger = NatsBus(bus.url(user), A, on_packet=lambda packet: None, keys=keys, authority=bus.authority)
    with pytest.raises(BusUnavailable, match="TOWER_BUS_URL"):
        await stranger.open()


async def test_a_tower_believes_its_own_authority_only_and_speaks_over_tls(bus: Bus, tmp_path: Path) -> None:
    bus_certificate(tmp_path / "other", NAMES)
    for authority in (None, tmp_path / "other" / AUTHORITY, tmp_path / "none.pem"):
        tower = NatsBus(bus.url(), A, on_packet=lambda packet: None, keys=keys, authority=authority)
        with pytest.raises(BusUnavailable):
            await tower.open()


async def test_its_user_reaches_no_other_subject(bus: Bus) -> None:
    refused: list[str] = []

    async def failed(error: Exception) -> None:
        refused.append(str(error))

    client = Client()
    trust = ssl.create_default_context(cafile=bus.authority)
    await client.connect(bus.url(), tls=trust, error_cb=failed)
    try:
        await client.subscribe(">")
        await client.publish("$SYS.REQ.SERVER.PING", b"")
        await client.flush()
        await until("both refusals", lambda: len(refused) == 2)
    finally:
        await client.close()
    assert all("permissions violation" in one.lower() for one in refused)


@pytest.fixture
def postgres(missing: Callable[[str], None]) -> Iterator[OwnPostgres]:
    with own_postgres(missing) as own:
        yield own


async def test_a_tower_uses_it(bus: Bus, tmp_path: Path, postgres: OwnPostgres) -> None:
    var = tmp_path / "var"
    var.mkdir()
    async with start_tower(
        var,
        database_url=postgres.url.replace("postgresql://", "postgresql+asyncpg://"),
        bus_url=bus.url(),
        bus_authority=bus.authority,
        secret_keys=new_key(),
    ) as world:
        several = world.tower.several
        assert several is not None
        assert several.bus.is_connected


def test_a_certificate_is_made_once_and_again_before_it_ends(tmp_path: Path) -> None:
    bus_certificate(tmp_path, NAMES)
    first = (tmp_path / CERTIFICATE).read_bytes()
    assert stat.S_IMODE((tmp_path / KEY).stat().st_mode) == 0o600
    bus_certificate(tmp_path, NAMES)
    assert (tmp_path / CERTIFICATE).read_bytes() == first
    now = utc_now()
    assert is_valid(tmp_path, NAMES, now + VALID_FOR - RENEWED_BEFORE - timedelta(days=2))
    assert not is_valid(tmp_path, NAMES, now + VALID_FOR - RENEWED_BEFORE)
    assert not is_valid(tmp_path, ["bus"], now)
    (tmp_path / KEY).unlink()
    bus_certificate(tmp_path, NAMES)
    assert (tmp_path / CERTIFICATE).read_bytes() != first


def test_a_broken_certificate_is_made_again(tmp_path: Path) -> None:
    assert not is_valid(tmp_path, NAMES, utc_now())
    (tmp_path / CERTIFICATE).write_text("no certificate")
    assert not is_valid(tmp_path, NAMES, utc_now())
    bus_certificate(tmp_path, NAMES)
    assert is_valid(tmp_path, NAMES, utc_now())
