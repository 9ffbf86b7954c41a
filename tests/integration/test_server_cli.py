"""The `tower` command as people use it: a process, its output, its exit code.

The processes are forked (`worlds.program_forker`), except where the installed script serves: its start is imports.
"""

import asyncio
import os
import re
import signal
import socket
import stat
import sys
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import httpx
import pytest
from sqlalchemy import func, select, update
from tower_world import start_tower
from worlds.forked_programs import run_forked

from server.audit.store.tables import AuditEventRow

TOWER = Path(sys.executable).with_name("tower")


class Shell:
    """Runs `tower` with its own environment. `as_installed`: the console script, in a new interpreter."""

    def __init__(self, var: Path, *, as_installed: bool = False) -> None:
        self._as_installed = as_installed
        kept = {name: os.environ[name] for name in ("PATH", "HOME", "LANG", "PYTHONPATH") if name in os.environ}
        self.environment = kept | {
            "TOWER_VAR": str(var),
            "TOWER_PORT": "0",
            "TOWER_UDP_PORT": "0",
            "TOWER_ARGON2_MEMORY_KIB": "19456",
            "TOWER_ARGON2_ROUNDS": "2",
        }

    async def run(self, *arguments: str, stdin: str = "", code: int = 0, **environment: str) -> str:
        """Returns standard output, or standard error if a failure is expected."""
        command, all_variables = (str(TOWER), *arguments), self.environment | environment
        if self._as_installed:
            exit_code, out, err = await _started(command, all_variables, stdin.encode())
        else:
            exit_code, out, err = await asyncio.to_thread(run_forked, command, all_variables, stdin.encode())
        assert exit_code == code, (out, err)
        assert b"Traceback" not in err
        return (err if code else out).decode()


async def _started(
    command: Sequence[str], environment: dict[str, str], stdin: bytes
) -> tuple[int | None, bytes, bytes]:
    pipe = asyncio.subprocess.PIPE
    process = await asyncio.create_subprocess_exec(*command, env=environment, stdin=pipe, stdout=pipe, stderr=pipe)
    out, err = await asyncio.wait_for(process.communicate(stdin), 120)
    return process.returncode, out, err


@pytest.fixture
async def shell(tmp_path: Path) -> Shell:
    shell = Shell(tmp_path / "var")
    await shell.run("migrate")
    return shell


async def test_commands_beside_a_tower_leave_its_write_ahead_log(tmp_path: Path) -> None:
    """A command that ends must not take itself for the last user of the database: it would remove the log into which
    the tower writes on, and everything from then on would be lost."""
    async with start_tower(tmp_path) as world:
        beside = Shell(world.settings.var)
        log = world.settings.var / "tower.sqlite3-wal"
        before = log.stat().st_ino
        for number in range(3):
            await beside.run("user", "add", f"anna-{number}")
            assert log.stat().st_ino == before
            person = await world.add_user(f"ben-{number}")
            assert f"ben-{number}" in await beside.run("user", "list")
            assert (await world.signed_in(person)).cookies
    assert "ben-2" in await beside.run("user", "list"), "also after the tower has ended"


async def test_before_migrate_every_command_says_what_to_run(tmp_path: Path) -> None:
    shell = Shell(tmp_path / "var")
    for arguments in (("serve", "--standby"), ("user", "list"), ("drone", "list")):
        error = await shell.run(*arguments, code=1)
        assert error == "tower: the database is empty: run `tower migrate` first\n"
    for _ in range(2):
        assert "revision" in await shell.run("migrate")
    assert (tmp_path / "var").stat().st_mode & 0o077 == 0


async def test_users(shell: Shell) -> None:
    out = await shell.run("user", "add", "Root", "--role", "admin")
    assert re.search(r"^password: \S{20,}$", out, re.MULTILINE)
    out = await shell.run("user", "add", "Anna", "--password-stdin", stdin="four words are longer\n")
    assert "four words" not in out
    assert "password" not in out
    listed = (await shell.run("user", "list")).splitlines()
    assert [line.split() for line in listed] == [
        ["ID", "NAME", "ROLE", "STATE"],
        ["1", "Root", "admin", "first", "password"],
        ["2", "Anna", "operator", "first", "password"],
    ]
    await shell.run("user", "disable", "anna")
    assert "disabled" in (await shell.run("user", "list")).splitlines()[2]
    await shell.run("user", "enable", "anna")
    assert "password: " in await shell.run("user", "password", "anna")


MISTAKES = (
    (("user", "add", "ROOT"), "", "another user has this name"),
    (("user", "add", "Eve", "--password-stdin"), "short\n", "a password needs at least 12 characters"),
    (("user", "add", " "), "", "a name must not be empty"),
    (("user", "disable", "Root"), "", "the last admin"),
    (("user", "disable", "Nobody"), "", "there is no user named Nobody"),
    (("drone", "add", "kite", "--owner", "Nobody"), "", "there is no user named Nobody"),
    (("drone", "add", "kite", "--token-file", "/proc/none/token"), "", "cannot write /proc/none/token"),
    (("drone", "assign", "none", "Root"), "", "there is no drone none"),
    (("drone", "revoke", "7"), "", "there is no drone 7"),
    (("token", "add", "Nobody", "log", "--scope", "watch"), "", "there is no user named Nobody"),
    (("token", "add", "Root", "log", "--scope", "watch", "--expires-days", "0"), "", "a token lives for up to"),
    (("token", "revoke", "7"), "", "there is no such token"),
)


async def test_mistakes_are_told_in_one_line_and_change_nothing(shell: Shell) -> None:
    await shell.run("user", "add", "Root", "--role", "admin")
    for arguments, stdin, words in MISTAKES:
        error = await shell.run(*arguments, stdin=stdin, code=1)
        assert error.startswith("tower: ")
        assert words in error
        assert error.count("\n") == 1
    assert len((await shell.run("user", "list")).splitlines()) == 2
    assert len((await shell.run("drone", "list")).splitlines()) == 1


async def test_drones(shell: Shell, tmp_path: Path) -> None:
    token = tmp_path / "tokens" / "hawk"
    await shell.run("user", "add", "Anna")
    await shell.run("user", "add", "Ben")
    out = await shell.run("drone", "add", "hawk", "--owner", "anna", "--owner", "Ben", "--token-file", str(token))
    assert "twe_" not in out
    assert re.fullmatch(r"twe_[A-Za-z0-9_-]{43}\n", token.read_text())
    assert stat.S_IMODE(token.stat().st_mode) == 0o600
    assert re.search(r"enrolment token: twe_\S{43}$", await shell.run("drone", "add", "kite"), re.MULTILINE)
    await shell.run("drone", "unassign", "1", "ben")
    await shell.run("drone", "assign", "kite", "ben")
    listed = (await shell.run("drone", "list")).splitlines()
    none = ["none:", "not", "enrolled"]
    assert [line.split() for line in listed[1:]] == [["1", "hawk", "Anna", *none], ["2", "kite", "Ben", *none]]
    before = token.read_text()
    await shell.run("drone", "enrol", "hawk", "--token-file", str(token))
    assert token.read_text() != before
    assert [path.name for path in token.parent.iterdir()] == ["hawk"]
    assert "no agent can sign in as hawk until one is enrolled" in await shell.run("drone", "revoke", "1")


async def test_tokens(shell: Shell, tmp_path: Path) -> None:
    await shell.run("user", "add", "Anna")
    file = tmp_path / "anna.token"
    out = await shell.run("token", "add", "anna", "flight log", "--scope", "watch", "--token-file", str(file))
    assert "twt_" not in out
    assert re.fullmatch(r"twt_[A-Za-z0-9_-]{43}\n", file.read_text())
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    both = ("--scope", "watch", "--scope", "fly", "--expires-days", "30")
    assert re.search(r"token: twt_\S{43}$", await shell.run("token", "add", "anna", "QGC", *both), re.MULTILINE)
    assert "only an admin's" in await shell.run("token", "add", "anna", "all", "--scope", "admin", code=1)
    listed = (await shell.run("token", "list")).splitlines()
    assert listed[1].split()[:6] == [
        "1",
        "flight",
        "log",
        "Anna",
        "watch",
        f"{datetime.now(UTC) + timedelta(days=90):%Y-%m-%d}",
    ]
    assert "fly,watch" in listed[2]
    assert await shell.run("token", "revoke", "1") == "token 1 is revoked\n"
    assert len((await shell.run("token", "list")).splitlines()) == 2


async def test_bad_settings_are_named_and_not_shown(shell: Shell) -> None:
    error = await shell.run("serve", code=2, TOWER_PORT="secret-value")
    assert error == "tower: TOWER_PORT must be a whole number\n"


async def test_serve_tells_its_address_and_stops_quietly(shell: Shell, tmp_path: Path) -> None:
    await shell.run("user", "add", "Root", "--role", "admin", "--password-stdin", stdin="four words are longer\n")
    process = await asyncio.create_subprocess_exec(
        TOWER, "serve", env=shell.environment, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE
    )
    assert process.stdout is not None
    try:
        line = (await asyncio.wait_for(process.stdout.readline(), 30)).decode()
        assert line.startswith("Control Tower is at http://127.0.0.1:")
        address = line.split()[-1]
        async with httpx.AsyncClient(base_url=address, trust_env=False) as client:
            credentials = {"name": "root", "password": "four words are longer"}
            assert (await client.post("/api/v1/session", json=credentials)).status_code == 200
        port = httpx.URL(address).port
        installed = Shell(tmp_path / "var", as_installed=True)
        error = await installed.run("serve", code=1, TOWER_PORT=str(port))
        assert f"port {port} on 127.0.0.1 is in use: set TOWER_PORT to another one" in error
    finally:
        process.send_signal(signal.SIGTERM)
    _, err = await asyncio.wait_for(process.communicate(), 60)
    assert process.returncode == 0, err
    assert b"Traceback" not in err
    assert b"four words are longer" not in err


async def test_a_udp_port_in_use_is_one_line(shell: Shell) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        error = await shell.run("serve", code=1, TOWER_UDP_PORT=str(port))
    assert f"tower: port {port} on 127.0.0.1 is in use: set TOWER_UDP_PORT to another one\n" in error


async def test_a_changed_audit_event_is_named(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        await world.add_user("Ann")
        await world.tower.audit_sealer.once()
        url = world.settings.database_url
        shell = Shell(tmp_path / "var")
        said = await shell.run("audit", "verify", DATABASE_URL=url)
        assert "events are as they were written" in said and "1 signed heads fit" in said
        async with world.database.writing() as session:
            first = await session.scalar(select(func.min(AuditEventRow.id)))
            await session.execute(update(AuditEventRow).where(AuditEventRow.id == first).values(actor_name="Eve"))
        refused = await shell.run("audit", "verify", code=1, DATABASE_URL=url)
        assert f"event {first} was changed" in refused
