"""A thousand browsers that return together are written in few transactions, and each of them is written."""

import asyncio
from datetime import UTC, datetime, timedelta
from pathlib import Path

from server.accounts.store.sessions import Sessions
from server.accounts.store.users import create_user
from server.audit.store.action import AuditAction
from server.audit.store.trail import COMMAND_LINE
from server.kernel.people import Role
from server.storage.database import open_database
from server.storage.schema import migrate

NOW = datetime(2026, 1, 1, tzinfo=UTC)
BROWSERS = 40


async def test_returning_browsers_share_a_transaction(tmp_path: Path) -> None:
    database = open_database(f"sqlite+aiosqlite:///{tmp_path / 'tower.sqlite3'}")
    try:
        await migrate(database)
        sessions = Sessions(database, idle_s=3600, lifetime_s=86_400)
        async with database.writing() as session:
            action = AuditAction(by=COMMAND_LINE, at=NOW)
            user = await create_user(session, name="Alice", role=Role.OPERATOR, password_hash="x", action=action)
            begun = [
                await sessions.begin(session, user_id=user.id, now=NOW, address="", user_agent="")
                for _ in range(BROWSERS)
            ]
        writes = 0
        writing = database.writing

        def counted() -> object:
            nonlocal writes
            writes += 1
            return writing()

        database.writing = counted  # type: ignore[method-assign,assignment]
        later = NOW + timedelta(minutes=2)
        found = await asyncio.gather(*(sessions.find(one.token, later) for one in begun))
        assert all(one is not None and one.expires_at == later + timedelta(hours=1) for one in found)
        assert 1 <= writes < BROWSERS / 2
        writes = 0
        await asyncio.gather(*(sessions.find(one.token, later + timedelta(seconds=1)) for one in begun))
        assert writes == 0, "every one was written"
    finally:
        await database.close()
