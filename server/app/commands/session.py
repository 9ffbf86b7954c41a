"""Common parts of subcommands that use the database: settings, an open and current database, clear errors."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from server.accounts.store.passwords import Passwords
from server.audit.store.action import AuditAction
from server.audit.store.trail import COMMAND_LINE
from server.runtime.settings import Settings, read_settings
from server.storage.database import Database, open_database
from server.storage.schema import check_schema

Answer = TypeVar("Answer")


class CommandError(Exception):
    """An error that the user can correct. One line."""


def settings_now() -> Settings:
    return read_settings(os.environ)


def action_now() -> AuditAction:
    return AuditAction(by=COMMAND_LINE, at=datetime.now(UTC))


def passwords_of(settings: Settings) -> Passwords:
    return Passwords(concurrency=1, memory_kib=settings.argon2_memory_kib, rounds=settings.argon2_rounds)


def with_database(work: Callable[[Database, Settings], Awaitable[Answer]]) -> Answer:
    """Runs `work` on the configured database, which must be at the newest revision."""
    settings = settings_now()

    async def go() -> Answer:
        database = open_database(settings.database_url)
        try:
            await check_schema(database)
            return await work(database, settings)
        finally:
            await database.close()

    return asyncio.run(go())


def keep_secret(secret: str, token_file: Path | None) -> None:
    """Writes a secret to a file that only its owner can read; does nothing without a file. Raises CommandError."""
    if token_file is None:
        return
    # Written beside and moved into place: never a partial secret, and never readable by others.
    fresh = token_file.with_name(f".{token_file.name}.{os.getpid()}")
    try:
        token_file.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "w") as opened:
            opened.write(f"{secret}\n")
        fresh.replace(token_file)
    except OSError as error:
        raise CommandError(f"cannot write {token_file}: {error.strerror}") from error


def as_table(headings: tuple[str, ...], rows: list[tuple[Any, ...]]) -> str:
    """Formats aligned columns, for people and for `awk`."""
    lines = [headings, *[tuple(str(cell) for cell in row) for row in rows]]
    widths = [max(len(line[column]) for line in lines) for column in range(len(headings))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines
    )
