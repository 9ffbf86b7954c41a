"""Whether SQLite's file is whole. PostgreSQL has checksums and tools of its own (`pg_amcheck`)."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

from sqlalchemy import make_url

WAITS_S = 5.0


def sqlite_file(database_url: str) -> Path | None:
    """None: another database, or one in memory."""
    url = make_url(database_url)
    return Path(url.database) if url.get_backend_name() == "sqlite" and url.database else None


def fault_in(file: Path, *, whole: bool) -> str:
    """What is wrong with a database file, in SQLite's words; empty: nothing. Reads all of it and writes nothing; a
    tower may run on it. `whole`: compares every index with its table too, which takes several times as long. Blocks."""
    pragma = "integrity_check" if whole else "quick_check"
    try:
        with closing(sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro", uri=True, timeout=WAITS_S)) as connection:
            [(found,)] = connection.execute(f"PRAGMA {pragma}(1)").fetchall()
    except sqlite3.OperationalError as error:
        return "" if "locked" in str(error) else str(error)
    except sqlite3.DatabaseError as error:
        return str(error)
    return "" if found == "ok" else " ".join(str(found).split())[:200]
