"""The present state of the database: its kind, revision, size and response time."""

from __future__ import annotations

import time
from dataclasses import dataclass

from sqlalchemy import text

from server.storage.database import Database


@dataclass(frozen=True)
class DatabaseFacts:
    """`kind`: sqlite or postgresql; `revision`: of the schema."""

    kind: str
    revision: str
    answered_in_ms: float
    size_bytes: int


async def database_facts(database: Database) -> DatabaseFacts:
    """Queries the database now."""
    kind = database.engine.url.get_backend_name()
    # On PostgreSQL the size comes from the files, not from the rows, however large the database is.
    size = "SELECT page_count * page_size FROM pragma_page_count(), pragma_page_size()"
    began = time.perf_counter()
    async with database.reading() as session:
        revision = await session.scalar(text("SELECT version_num FROM alembic_version"))
        answered_in_ms = (time.perf_counter() - began) * 1000
        size_bytes = await session.scalar(
            text(size if kind == "sqlite" else "SELECT pg_database_size(current_database())")
        )
    return DatabaseFacts(kind, str(revision), round(answered_in_ms, 1), int(size_bytes or 0))
