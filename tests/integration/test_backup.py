"""`tower backup`, `restore`, `copy-database` and `migrate --to`, as people use them, with a running tower."""

import asyncio
import io
import json
import stat
import tarfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select, text
from test_server_cli import Shell
from tower_world import Person, TowerWorld, start_tower

from server.accounts.store.tables import UserRow
from server.backup.store.archive import ArchiveReader, BadArchive
from server.backup.store.table_rows import copied_tables
from server.kernel.people import Role
from server.storage.database import open_database
from server.storage.schema import migrate, newest_revision
from server.storage.tables import METADATA

LOG = b"\xa3\x95" * 50_000


async def _fill(world: TowerWorld) -> Person:
    """Something in every kind of table that a person fills, and files of drones."""
    root = await world.add_user("Root", Role.ADMIN)
    anna = await world.add_user("Änna")
    admin, hers = await world.signed_in(root), await world.signed_in(anna)
    drone = await world.add_drone("Kestrel", anna)
    assert (await hers.put("/api/v1/me/preferences/units", json={"units": "metric", "x": [1, None]})).status_code == 204
    body = {"name": "field", "document": {"mission": [], "fence": [], "rally": []}, "shared": True}
    assert (await hers.post("/api/v1/missions", json=body)).status_code == 201
    assert (await hers.post("/api/v1/me/second-factor")).status_code == 200
    path = f"/api/v1/drones/{drone.id}"
    assert (await admin.patch(f"{path}/settings", json={"lost_action": "land"})).status_code == 200
    # An id that was used once must not be used again: the last drone is deleted.
    gone = await world.add_drone("Gone")
    assert (await admin.delete(f"/api/v1/drones/{gone.id}")).status_code == 204
    log = world.settings.files / f"drone-{drone.id}" / "7-1767225600.bin"
    log.parent.mkdir(parents=True, exist_ok=True)
    log.write_bytes(LOG)
    (log.parent / "9-1.part").write_bytes(b"half")
    return root


async def _contents(url: str) -> dict[str, list[str]]:
    """Every row of every table, without sessions."""
    database = open_database(url)
    try:
        async with database.reading() as session:
            return {
                table.name: sorted(map(repr, (await session.execute(select(table))).all()))
                for table in copied_tables()
                if table.name != "sessions"
            }
    finally:
        await database.close()


@pytest.fixture
def shell(tmp_path: Path) -> Shell:
    return Shell(tmp_path / "new")


@pytest.fixture(params=["sqlite", "postgresql"])
def settings(request: pytest.FixtureRequest) -> dict[str, Any]:
    """Of a tower on each kind of database."""
    if request.param == "sqlite":
        return {}
    return {
        "database_url": request.getfixturevalue("migrated_postgres_url").replace(
            "postgresql://", "postgresql+asyncpg://"
        )
    }


async def test_a_backup_of_a_running_tower_is_restored_elsewhere(tmp_path: Path, settings: dict[str, Any]) -> None:
    shell = Shell(tmp_path / "new")
    archive = tmp_path / "tower.tar"
    async with start_tower(tmp_path, **settings) as world:
        root = await _fill(world)
        old = {"TOWER_VAR": str(world.settings.var), "DATABASE_URL": world.settings.database_url}
        # People go on changing things meanwhile: the archive has one moment.
        admin = await world.signed_in(root)
        ends = asyncio.Event()

        async def rename() -> None:
            number = 0
            while not ends.is_set():
                number += 1
                assert (await admin.patch("/api/v1/drones/1", json={"name": f"Kestrel {number}"})).status_code == 200

        renaming = asyncio.create_task(rename())
        said = await shell.run("backup", str(archive), **old)
        ends.set()
        await renaming
        assert "3 files, the keys" in said  # a log, and the numbers of two folders
        error = await shell.run("backup", str(archive), code=1, **old)
        assert "is there already" in error
        # A tower runs: its database has rows, and nothing is overwritten.
        error = await shell.run("restore", str(archive), code=1, **old)
        assert "is not empty" in error
        key = (world.settings.var / "secret.key").read_text()
    assert stat.S_IMODE(archive.stat().st_mode) == 0o600
    assert "is complete" in await shell.run("check-backup", str(archive))

    said = await shell.run("restore", str(archive))
    assert f"revision {newest_revision()}" in said
    new = tmp_path / "new"
    assert (new / "secret.key").read_text() == key
    assert stat.S_IMODE((new / "secret.key").stat().st_mode) == 0o600
    assert (new / "files" / "drone-1" / "7-1767225600.bin").read_bytes() == LOG
    assert not list((new / "files").rglob("*.part"))
    with ArchiveReader(archive) as reader:
        manifest = reader.check()
    restored = await _contents(f"sqlite+aiosqlite:///{new / 'tower.sqlite3'}")
    assert {name: len(rows) for name, rows in restored.items()} == {
        name: count for name, count in manifest.tables.items() if name != "sessions"
    }
    kept = await _contents(settings.get("database_url") or f"sqlite+aiosqlite:///{tmp_path / 'var' / 'tower.sqlite3'}")
    changed = {"drones", "audit_events", "fleet_revision", "user_addresses", "known_addresses"}
    changed |= {"audit_chain", "audit_chain_state", "audit_heads"}  # the old tower went on
    assert {name: rows for name, rows in restored.items() if name not in changed} == {
        name: rows for name, rows in kept.items() if name not in changed
    }
    error = await shell.run("restore", str(archive), code=1)
    assert "is not empty" in error

    # The restored tower works: people sign in with their passwords, the key opens what it sealed, ids go on.
    (tmp_path / "again").mkdir()
    (tmp_path / "again" / "var").symlink_to(new)
    async with start_tower(tmp_path / "again") as world:
        admin = await world.signed_in("Root")
        assert (await admin.get("/api/v1/drones/1/logs")).status_code == 200
        made = await admin.post("/api/v1/drones", json={"name": "New"})
        assert made.json()["drone"]["id"] == 3, "the id of a deleted drone is never used again"
        (anna,) = [one for one in (await admin.get("/api/v1/users")).json() if one["name"] == "Änna"]
        assert anna["role"] == "operator"


async def test_a_tower_that_runs_on_the_place_is_noticed(tmp_path: Path, shell: Shell) -> None:
    """Its tables are empty, for it was migrated, but a process has its lock."""
    archive = tmp_path / "tower.tar"
    await shell.run("migrate")
    await shell.run("backup", str(archive), "--without-files")
    async with start_tower(tmp_path) as world:
        old = {"TOWER_VAR": str(world.settings.var), "TOWER_FILES": str(tmp_path / "no"), "TOWER_SECRET_KEYS": ""}
        async with world.database.writing() as session:
            for table in reversed(METADATA.sorted_tables):
                if table.name not in ("tower_lock", "fleet_revision"):
                    await session.execute(table.delete())
        (world.settings.var / "secret.key").unlink()
        error = await shell.run("restore", str(archive), code=1, **old)
        assert "another tower serves this database" in error
        assert not (world.settings.var / "secret.key").exists()


async def test_damage_is_found_before_anything_is_written(tmp_path: Path, shell: Shell) -> None:
    await shell.run("migrate")
    await shell.run("user", "add", "admin", "--role", "admin")
    archive, var = tmp_path / "tower.tar", tmp_path / "new"
    await shell.run("backup", str(archive))
    for path in var.iterdir():
        path.unlink()
    whole = archive.read_bytes()
    with tarfile.open(archive) as tar:
        at = tar.getmember("database/users.jsonl.gz").offset_data
    damaged = {
        "is not what was written": whole[: at + 40] + b"\xff\x00" + whole[at + 42 :],
        "has no list of its contents": whole[: at - 512] + b"\0" * 1024,
        "is no complete backup": whole[: len(whole) // 2],
        "is no backup": b"PK" * 4000,
    }
    for words, content in damaged.items():
        archive.write_bytes(content)
        for command in ("restore", "check-backup"):
            error = await shell.run(command, str(archive), code=1)
            assert words in error, (words, error)
            assert len(error.splitlines()) == 1
        assert not [one for one in var.iterdir() if one.name.startswith("secret") or "restoring" in one.name]
    archive.write_bytes(whole)
    await shell.run("restore", str(archive))
    assert "admin" in await shell.run("user", "list")


def _forged(source: Path, target: Path, change: Callable[[dict[str, Any]], None], extra: str = "") -> None:
    """The same archive with another manifest."""
    with tarfile.open(source) as old, tarfile.open(target, "w") as new:
        for entry in old:
            file = old.extractfile(entry)
            assert file is not None
            content = file.read()
            if entry.name == "manifest.json":
                if extra:
                    added = tarfile.TarInfo(extra)
                    new.addfile(added)
                document = json.loads(content)
                change(document)
                content = json.dumps(document).encode()
                entry.size = len(content)
            new.addfile(entry, io.BytesIO(content))


async def test_an_older_backup_is_upgraded_and_a_newer_one_is_refused(tmp_path: Path, shell: Shell) -> None:
    await shell.run("migrate")
    await shell.run("user", "add", "admin", "--role", "admin")
    archive, older, newer, evil = (tmp_path / f"{name}.tar" for name in ("now", "older", "newer", "evil"))
    await shell.run("backup", str(archive))
    _forged(archive, older, lambda document: document.update(revision="0016"))
    _forged(archive, newer, lambda document: document.update(revision="9999"))
    empty = {"size_bytes": 0, "sha256": "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"}
    escaping = "files/../../escaped"
    _forged(archive, evil, lambda document: document["members"].update({escaping: empty}), escaping)
    for path in (tmp_path / "new").iterdir():
        path.unlink()
    assert "a newer version of the tower" in await shell.run("restore", str(newer), code=1)
    assert "is no name of a file" in await shell.run("restore", str(evil), code=1)
    assert f"revision {newest_revision()}" in await shell.run("restore", str(older))
    assert "admin" in await shell.run("user", "list")
    database = open_database(f"sqlite+aiosqlite:///{tmp_path / 'new' / 'tower.sqlite3'}")
    try:
        async with database.reading() as session:
            assert await session.scalar(select(func.count()).select_from(UserRow)) == 1
    finally:
        await database.close()


async def test_sqlite_to_postgresql_and_back(tmp_path: Path, shell: Shell, postgres_url: str) -> None:
    old = f"sqlite:///{tmp_path / 'var' / 'tower.sqlite3'}"
    async with start_tower(tmp_path) as world:
        await _fill(world)
        error = await shell.run("copy-database", "sqlite:///other.sqlite3", code=1, DATABASE_URL=old)
        assert "another tower serves this database" in error
    found = await _contents(old.replace("sqlite:", "sqlite+aiosqlite:"))
    asyncpg_url = postgres_url.replace("postgresql://", "postgresql+asyncpg://")
    said = await shell.run("copy-database", postgres_url, DATABASE_URL=old)
    assert f"drones: {len(found['drones'])} of {len(found['drones'])} rows" in said
    assert await _contents(asyncpg_url) == found
    assert "is not empty" in await shell.run("copy-database", postgres_url, code=1, DATABASE_URL=old)
    async with start_tower(tmp_path, database_url=asyncpg_url) as world:
        admin = await world.signed_in("Root")
        made = await admin.post("/api/v1/drones", json={"name": "New"})
        assert made.json()["drone"]["id"] == 3
    found = await _contents(asyncpg_url)
    back = tmp_path / "back.sqlite3"
    await shell.run("copy-database", f"sqlite:///{back}", DATABASE_URL=postgres_url)
    assert await _contents(f"sqlite+aiosqlite:///{back}") == found
    database = open_database(f"sqlite+aiosqlite:///{back}")
    try:
        async with database.reading() as session:
            last = await session.scalar(text("SELECT seq FROM sqlite_sequence WHERE name = 'drones'"))
        assert last == 3
    finally:
        await database.close()


async def test_migrate_goes_back_and_forth_but_not_under_a_tower(tmp_path: Path, shell: Shell) -> None:
    await shell.run("migrate")
    await shell.run("user", "add", "admin", "--role", "admin")
    assert await shell.run("migrate", "--to", "0015") == "the database is at revision 0015\n"
    assert "run `tower migrate`" in await shell.run("user", "list", code=1)
    await shell.run("migrate", "--to", "0016")
    assert await shell.run("migrate") == f"the database is at revision {newest_revision()}\n"
    assert "admin" in await shell.run("user", "list")
    assert "there is no revision 12" in await shell.run("migrate", "--to", "12", code=1)
    async with start_tower(tmp_path) as world:
        error = await shell.run("migrate", "--to", "0015", code=1, TOWER_VAR=str(world.settings.var))
        assert "another tower serves this database" in error


def test_a_backup_never_stands_half_under_its_name(tmp_path: Path) -> None:
    from server.backup.store.archive import ArchiveWriter

    path = tmp_path / "tower.tar"
    with ArchiveWriter(path) as archive:
        archive.add_bytes("files/a", b"x")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(BadArchive, match="there is no file"):
        ArchiveReader(path)


async def test_every_table_is_copied(tmp_path: Path) -> None:
    database = open_database(f"sqlite+aiosqlite:///{tmp_path / 'tower.sqlite3'}")
    try:
        await migrate(database)
        assert {table.name for table in copied_tables()} == set(METADATA.tables) - {"tower_lock"}
    finally:
        await database.close()
