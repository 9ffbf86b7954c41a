"""A real tower process for load: a database with an admin and any number of drones, and `tower serve` on it."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import secrets
import sys
import time
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import httpx

from bench.lean_browser import LeanBrowser, connect_browser
from server.accounts.store.passwords import Passwords
from server.accounts.store.users import create_user
from server.audit.store.action import AuditAction
from server.audit.store.trail import COMMAND_LINE
from server.fleet.store.drones import create_drone, set_key
from server.kernel.people import Role
from server.storage.database import open_database
from server.storage.schema import migrate
from wire.drone_key import KEY_BYTES, DroneKey
from wire.ids import DroneId

TOWER: Final = Path(sys.executable).parent / "tower"
CHECKOUT: Final = Path(__file__).resolve().parent.parent
PASSWORD: Final = "correct horse battery"
ADMIN: Final = "admin"
START_S: Final = 60.0
BUSY: Final = 503
AT_ONCE: Final = 100
"""Drones that are made in one transaction."""
BROWSER_SUBPROTOCOL: Final = "tower.v1"


@dataclass
class LoadTower:
    """A running tower. `process.pid` is the measured process."""

    url: str
    process: asyncio.subprocess.Process
    keys: list[str]
    """Of drones 1, 2, 3, ... in order."""
    cookie: str
    udp_port: int = 0
    """Of its data channel."""
    _browsers: list[LeanBrowser] = field(default_factory=list)

    async def browser(self) -> LeanBrowser:
        """Returns an admin's browser, which may watch every drone. It is closed with the tower."""
        browser = await connect_browser(
            self.url, path="/api/v1/live", cookie=self.cookie, subprotocol=BROWSER_SUBPROTOCOL
        )
        self._browsers.append(browser)
        return browser

    def close_browsers(self) -> None:
        for browser in self._browsers:
            browser.close()
        self._browsers.clear()


async def make_fleet(folder: Path, drones: int, operators: Sequence[str] = (), *, url: str = "") -> list[str]:
    """Creates a database in `folder`, or fills the one at `url`: an admin, operators of these names (all with
    PASSWORD), and the drones. Returns the drones' keys as text, in order."""
    database = open_database(url or f"sqlite+aiosqlite:///{folder / 'tower.sqlite3'}")
    passwords = Passwords(concurrency=1, memory_kib=19456, rounds=2)
    action = AuditAction(by=COMMAND_LINE, at=datetime.now(UTC))
    try:
        await migrate(database)
        hashed = await passwords.hash(PASSWORD)
        async with database.writing() as session:
            await create_user(
                session, name=ADMIN, role=Role.ADMIN, password_hash=hashed, action=action, must_change_password=False
            )
            for name in operators:
                await create_user(
                    session,
                    name=name,
                    role=Role.OPERATOR,
                    password_hash=hashed,
                    action=action,
                    must_change_password=False,
                )
        keys = []
        for first in range(1, drones + 1, AT_ONCE):  # in parts: a transaction has a deadline
            async with database.writing() as session:
                for number in range(first, min(first + AT_ONCE, drones + 1)):
                    row = await create_drone(session, name=f"Load {number}", action=action)
                    keys.append(DroneKey(DroneId(row.id), secrets.token_bytes(KEY_BYTES)))
                    await set_key(session, drone_id=row.id, public_key=keys[-1].public, action=action)
        return [str(key) for key in keys]
    finally:
        await passwords.close()
        await database.close()


@contextlib.asynccontextmanager
async def load_tower(
    folder: Path,
    *,
    drones: int,
    cpus: set[int] | None = None,
    settings: dict[str, str] | None = None,
    operators: Sequence[str] = (),
    keys: list[str] | None = None,
) -> AsyncIterator[LoadTower]:
    """Runs until the block ends. `cpus`: processors that the process is bound to. `settings`: more environment
    variables. `keys`: of the drones, where the folder has a fleet already."""
    folder.mkdir(parents=True, exist_ok=True)  # noqa: ASYNC240 (before anything runs)
    keys = await make_fleet(folder, drones, operators) if keys is None else keys
    log = folder / "tower.log"
    environment = {
        **os.environ,
        "TOWER_VAR": str(folder),
        "TOWER_HOST": "127.0.0.1",
        "TOWER_PORT": "0",
        "TOWER_UDP_PORT": "0",
        "TOWER_ARGON2_MEMORY_KIB": "19456",
        "TOWER_ARGON2_ROUNDS": "2",
        "TOWER_USER_SOCKETS": "1000",
        "TOWER_ADDRESS_SOCKETS": str(max(1000, 2 * drones)),
        "TOWER_AGENT_FRAMES_PER_S": "1000000",
        "TOWER_AGENT_FRAMES_BURST": "1000000",
        **(settings or {}),
    }
    with log.open("wb") as out:
        process = await asyncio.create_subprocess_exec(
            str(TOWER), "serve", stdin=asyncio.subprocess.DEVNULL, stdout=out, stderr=out, env=environment, cwd=CHECKOUT
        )
    tower: LoadTower | None = None
    try:
        if cpus:
            os.sched_setaffinity(process.pid, cpus)
        url = await _address(process, log)
        async with httpx.AsyncClient(base_url=url, timeout=30, trust_env=False) as client:
            cookie = await _sign_in(client)
        tower = LoadTower(url, process, keys, cookie, _udp_port(log))
        yield tower
    finally:
        if tower is not None:
            tower.close_browsers()
        await end(process)


async def _sign_in(client: httpx.AsyncClient) -> str:
    """The admin's cookie. A tower on a busy machine may refuse at first. Raises httpx.HTTPStatusError."""
    began = time.monotonic()
    while True:
        answer = await client.post("/api/v1/session", json={"name": ADMIN, "password": PASSWORD})
        if answer.status_code != BUSY or time.monotonic() - began > START_S:
            answer.raise_for_status()
            return "; ".join(f"{name}={value}" for name, value in client.cookies.items())
        await asyncio.sleep(0.5)


async def as_somebody(tower: LoadTower, name: str) -> LoadTower:
    """Returns the same tower with the cookie of one of its operators."""
    async with httpx.AsyncClient(base_url=tower.url, timeout=30, trust_env=False) as client:
        answer = await client.post("/api/v1/session", json={"name": name, "password": PASSWORD})
        answer.raise_for_status()
        return replace(tower, cookie="; ".join(f"{name}={value}" for name, value in client.cookies.items()))


async def end(process: asyncio.subprocess.Process) -> None:
    """Asks the process to stop, and kills it if it does not."""
    if process.returncode is None:
        with contextlib.suppress(ProcessLookupError):
            process.terminate()
        try:
            await asyncio.wait_for(process.wait(), 10)
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()


def _udp_port(log: Path) -> int:
    found = re.search(r".*data_channel_open.*", log.read_text(errors="replace"))
    port = re.search(r'"port": (\d+)', found[0]) if found else None
    return int(port[1]) if port else 0


async def _address(process: asyncio.subprocess.Process, log: Path) -> str:
    async with asyncio.timeout(START_S):
        while True:
            words = log.read_text(errors="replace")  # noqa: ASYNC240
            found = re.search(r"is at (http://[\d.]+:\d+)", words)
            if found:
                return found[1]
            if process.returncode is not None:
                raise RuntimeError(words[-2000:])
            await asyncio.sleep(0.05)
