"""The first `tower serve` in an empty folder: it creates the database and a first admin, who must change the password.

`tower serve` does so for the embedded database only. A shared one is created by `tower migrate`, once, on purpose.
"""

from __future__ import annotations

import asyncio
from typing import Final

from server.accounts.store.passwords import generate_password
from server.accounts.store.users import create_user, list_users
from server.app.commands.session import action_now, passwords_of
from server.kernel.people import Role
from server.runtime.settings import Settings
from server.storage.database import open_database, sqlite_file
from server.storage.schema import migrate

FIRST_ADMIN: Final = "admin"


def is_first_start(settings: Settings) -> bool:
    """Whether the embedded database does not exist yet."""
    file = sqlite_file(settings.database_url)
    return file is not None and (not file.exists() or file.stat().st_size == 0)


def create_database(settings: Settings) -> str | None:
    """Creates the database, or upgrades it. If there is no user, adds the first admin and returns the password."""
    password = generate_password()

    async def work() -> bool:
        database = open_database(settings.database_url)
        try:
            await migrate(database, vault=settings.vault())
            async with database.reading() as session:
                if await list_users(session):
                    return False
            password_hash = await passwords_of(settings).hash(password)
            async with database.writing() as session:
                await create_user(
                    session,
                    name=FIRST_ADMIN,
                    role=Role.ADMIN,
                    password_hash=password_hash,
                    action=action_now(),
                    must_change_password=True,
                )
            return True
        finally:
            await database.close()

    return password if asyncio.run(work()) else None


def in_words(password: str) -> str:
    """What the person at the keyboard, or in the journal, has to know."""
    return f"The first user is {FIRST_ADMIN} with the password {password}, to be changed at sign-in"
