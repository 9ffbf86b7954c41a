"""A tower for one test: a fresh database, a port from the kernel, real sockets, a clock that can be moved."""

from __future__ import annotations

import asyncio
import atexit
import secrets
import shutil
import socket
import ssl
import tempfile
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path
from typing import Any

import httpx
from worlds.compiled_statements import share_compiled_statements

from onboard_agent.link.identity import Identity, Kept
from onboard_agent.link.identity_file import write_private
from server.accounts.store.users import create_user
from server.app.composition import create_app
from server.app.serving import TowerServer
from server.app.tower import Tower, TowerApp
from server.audit.store.action import AuditAction
from server.audit.store.trail import COMMAND_LINE
from server.fleet.store.drones import add_owner, create_drone, get_drone, set_key
from server.fleet.store.snapshot import begin_fleet_change
from server.kernel.people import Role
from server.runtime.listening import address_in_words, listen
from server.runtime.settings import Settings
from server.storage.database import Database, open_database
from server.storage.schema import current_revision, migrate, newest_revision
from wire.credential import Credential
from wire.drone_key import KEY_BYTES, DroneKey
from wire.ids import DroneId

share_compiled_statements()

PASSWORD = "correct horse battery"
"""The password of every user that a world makes."""
START_WITHIN_S = 30.0


def assert_problem(answer: httpx.Response, status: int, slug: str) -> dict[str, Any]:
    """Asserts that the response is a complete problem document of this kind. Returns it."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    document: dict[str, Any] = answer.json()
    assert document["type"] == f"/problems/{slug}"
    assert document["status"] == status
    assert document["title"]
    assert document["instance"] == answer.request.url.path
    return document


class MovableClock:
    """The time of day plus the offset set by a test. While stopped, it advances only when moved."""

    def __init__(self) -> None:
        self._ahead = timedelta()
        self._stopped_at: datetime | None = None

    def __call__(self) -> datetime:
        return (self._stopped_at or datetime.now(UTC)) + self._ahead

    def stop(self) -> None:
        """For deadlines of a second, which on a busy machine would expire before the next request."""
        self._stopped_at = datetime.now(UTC)

    def advance(self, seconds: float) -> None:
        self._ahead += timedelta(seconds=seconds)


@dataclass(frozen=True)
class Person:
    id: int
    name: str
    role: Role


@dataclass(frozen=True)
class NewDrone:
    id: int
    name: str
    key: DroneKey

    @property
    def identity(self) -> Identity:
        """Returns the identity as the drone's agent has it."""
        return Identity(Kept(self.key.drone_id, self.key))

    def keep(self, path: Path) -> None:
        """Writes the identity to a file for an agent."""
        write_private(path, f"{self.key}\n")


@dataclass
class TowerWorld:
    base_url: str
    settings: Settings
    clock: MovableClock
    app: TowerApp
    _stack: AsyncExitStack = field(repr=False)

    @property
    def tower(self) -> Tower:
        return self.app.tower

    @property
    def database(self) -> Database:
        return self.tower.database

    @property
    def udp_port(self) -> int:
        return self.app.state.data_endpoint.port

    @property
    def live_url(self) -> str:
        return self.base_url.replace("http", "ws", 1) + "/api/v1/live"

    @property
    def agent_url(self) -> str:
        return self.base_url.replace("http", "ws", 1) + "/api/v1/agent"

    async def add_user(self, name: str, role: Role = Role.OPERATOR) -> Person:
        """Adds a user straight to the database. The password is PASSWORD."""
        password_hash = await self.tower.passwords.hash(PASSWORD)
        async with self.database.writing() as session:
            row = await create_user(
                session,
                name=name,
                role=role,
                password_hash=password_hash,
                action=self._action(),
                must_change_password=False,
            )
        await self.tower.roster.refresh()
        return Person(row.id, row.name, Role(row.role))

    async def add_drone(self, name: str, *owners: Person) -> NewDrone:
        async with self.database.writing() as session:
            row = await create_drone(session, name=name, action=self._action())
            key = DroneKey(DroneId(row.id), secrets.token_bytes(KEY_BYTES))
            await set_key(session, drone_id=row.id, public_key=key.public, action=self._action())
            for one in owners:
                await add_owner(session, drone_id=row.id, user_id=one.id, action=self._action())
        await self.tower.roster.refresh()
        return NewDrone(row.id, row.name, key)

    async def give_credential(self, drone: NewDrone) -> Credential:
        """Replaces its key by a credential, as an older version of the tower used."""
        credential = Credential(DroneId(drone.id), secrets.token_urlsafe(32))
        async with self.database.writing() as session:
            await begin_fleet_change(session)
            row = await get_drone(session, drone.id)
            row.credential_hash, row.public_key, row.key_since = credential.hashed(), None, None
        await self.tower.roster.refresh()
        return credential

    async def client(self, **options: Any) -> httpx.AsyncClient:
        """Returns a browser that has not signed in. The world closes it."""
        # The tower closes a connection after 5 s without a request; httpx might just then send the next one.
        limits = httpx.Limits(keepalive_expiry=2.0)
        options = {"verify": _trusting(), **options}
        opened = httpx.AsyncClient(base_url=self.base_url, trust_env=False, timeout=20, limits=limits, **options)
        return await self._stack.enter_async_context(opened)

    async def signed_in(self, person: Person | str) -> httpx.AsyncClient:
        """Returns a browser that has signed in."""
        client = await self.client()
        name = person if isinstance(person, str) else person.name
        answer = await client.post("/api/v1/session", json={"name": name, "password": PASSWORD})
        assert answer.status_code == 200, answer.text
        return client

    def cookie_header(self, client: httpx.AsyncClient) -> dict[str, str]:
        """Returns the header for opening a WebSocket with a client's session."""
        return {"Cookie": f"tower_session={client.cookies['tower_session']}"}

    def _action(self) -> AuditAction:
        return AuditAction(by=COMMAND_LINE, at=self.clock())


@asynccontextmanager
async def start_tower(tmp_path: Path, **settings: Any) -> AsyncIterator[TowerWorld]:
    """A running tower. `settings` replace the defaults, which suit fast isolated tests, not production."""
    var = tmp_path / "var"
    var.mkdir(exist_ok=True)
    values: dict[str, Any] = {
        "port": 0,
        "udp_port": 0,
        "var": var,
        "web": tmp_path / "no-console",
        "argon2_memory_kib": 64,
        "argon2_rounds": 1,
        "argon2_process": False,
        "database_timeout_s": 20.0,  # a disk that other tests keep busy
    } | settings
    chosen = Settings(**values)
    if chosen.is_sqlite and not (var / "tower.sqlite3").exists():
        copy_empty_database(var / "tower.sqlite3")
    elif not chosen.is_sqlite:
        database = open_database(chosen.database_url)
        if await current_revision(database) != newest_revision():
            await migrate(database)
        await database.close()
    clock = MovableClock()
    app = create_app(chosen, clock=clock)
    async with serving(app, listen("127.0.0.1", chosen.port)) as base_url, AsyncExitStack() as stack:
        yield TowerWorld(base_url, chosen, clock, app, stack)


@asynccontextmanager
async def serving(app: TowerApp, listener: socket.socket) -> AsyncIterator[str]:
    """Runs an application on a socket in the current event loop. Yields its address."""
    base_url = address_in_words(listener)
    listening = asyncio.Event()
    server = TowerServer(app, on_listening=listening.set)
    running = asyncio.create_task(server.run_on(listener))
    waiting = asyncio.create_task(listening.wait())
    try:
        await asyncio.wait({running, waiting}, timeout=START_WITHIN_S, return_when=asyncio.FIRST_COMPLETED)
        if running.done():
            await running  # raises its error
        assert listening.is_set(), "the tower did not start in time"
        yield base_url
    finally:
        waiting.cancel()
        server.should_exit = True
        if not running.done():
            await running


@cache
def _trusting() -> ssl.SSLContext:
    """Returns what httpx makes for each client. Reading all authorities took a third of the time of a test."""
    return httpx.create_ssl_context(trust_env=False)


def copy_empty_database(to: Path) -> None:
    """Copies an SQLite database of the newest revision. Migrating one takes half a second."""
    shutil.copyfile(_migrated(), to)


@cache
def _migrated() -> Path:
    """Returns an empty database at the newest revision. One migration is enough for all tests of a run."""
    folder = Path(tempfile.mkdtemp(prefix="tower-test-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    path = folder / "empty.sqlite3"

    async def work() -> None:
        database = open_database(f"sqlite+aiosqlite:///{path}")
        await migrate(database)
        async with database.engine.connect() as connection:
            await connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
        await database.close()

    _in_its_own_loop(work())
    return path


def _in_its_own_loop(work: Any) -> None:
    """Runs it in a thread, because the caller is inside a running loop."""
    from threading import Thread

    failed: list[BaseException] = []

    def go() -> None:
        try:
            asyncio.run(work)
        except BaseException as error:
            failed.append(error)

    thread = Thread(target=go)
    thread.start()
    thread.join()
    if failed:
        raise failed[0]
