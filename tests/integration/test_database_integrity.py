"""A database file that is not whole: told at the start of the tower, by a command, and by a backup."""

import asyncio
import sqlite3
from pathlib import Path

import pytest
from control_world import until
from test_server_cli import Shell
from tower_world import copy_empty_database, start_tower

from server.storage.integrity import fault_in, sqlite_file

PAGE = 4096


def with_rows(file: Path) -> None:
    """Some hundred pages."""
    connection = sqlite3.connect(file)
    connection.executemany(
        "INSERT INTO audit_events (at, actor_name, action, address, detail)"
        " VALUES ('2026-01-01 00:00:00', 'x', ?, '', '{}')",
        [(f"told.{number:04d}" + "x" * 40,) for number in range(4000)],
    )
    connection.commit()
    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()


def damage(file: Path) -> None:
    """Overwrites 16 bytes in the middle: the head of a page of a table."""
    content = bytearray(file.read_bytes())
    at = len(content) // 2 // PAGE * PAGE
    while content[at] != 13:  # the leaf of a table
        at += PAGE
    content[at : at + 16] = b"\xff" * 16
    file.write_bytes(content)


@pytest.fixture
def shell(tmp_path: Path) -> Shell:
    return Shell(tmp_path, as_installed=False)


async def test_sixteen_bytes_in_the_middle_are_found(tmp_path: Path, shell: Shell) -> None:
    file = tmp_path / "tower.sqlite3"
    copy_empty_database(file)
    with_rows(file)
    assert fault_in(file, whole=True) == fault_in(file, whole=False) == ""
    assert "is whole" in await shell.run("check-database")
    damage(file)
    for whole in (True, False):
        assert fault_in(file, whole=whole)
    assert "is damaged" in await shell.run("check-database", code=1)


async def test_a_tower_on_a_damaged_database_tells_its_admins(tmp_path: Path) -> None:
    var = tmp_path / "var"
    var.mkdir()
    copy_empty_database(var / "tower.sqlite3")
    with_rows(var / "tower.sqlite3")
    await asyncio.to_thread(damage, var / "tower.sqlite3")
    async with start_tower(tmp_path) as world:
        hub = world.tower.hub
        await until("the alert", lambda: {one.rule.name for one in hub.alerts.live()} == {"tower-database-damaged"})
        (alert,) = hub.alerts.live()
        assert alert.words.startswith("The file of the database is damaged: ")


def test_only_sqlite_has_a_file() -> None:
    assert sqlite_file("postgresql+asyncpg://tower@127.0.0.1/tower") is None
    assert sqlite_file("sqlite+aiosqlite:///var/tower.sqlite3") == Path("var/tower.sqlite3")


def test_what_is_no_database_is_said(tmp_path: Path) -> None:
    file = tmp_path / "tower.sqlite3"
    file.write_bytes(b"no database at all" * 400)
    assert "not a database" in fault_in(file, whole=False)
    assert fault_in(tmp_path / "none", whole=False)
