"""`tower audit ...`: checks that nobody changed the audit trail."""

from __future__ import annotations

from typing import Annotated

import typer

from server.app.commands.session import CommandError, with_database
from server.audit.store.verifying import Verdict, verify
from server.fleet.store.tower_identity import public_key_of
from server.runtime.settings import Settings
from server.storage.database import Database

app = typer.Typer(no_args_is_help=True, help="The audit trail.")


@app.callback()
def _group() -> None:
    """The audit trail."""


@app.command("verify")
def verify_trail(
    key: Annotated[
        list[str] | None,
        typer.Option(help="The tower's public key, as you noted it; may be repeated. Default: as in the database."),
    ] = None,
) -> None:
    """Check every event against the chain of hashes and its signatures. Names the first that was changed, added or
    removed, and fails."""

    async def work(database: Database, _settings: Settings) -> tuple[Verdict, list[str]]:
        found = await public_key_of(database)
        keys = key or ([found] if found else [])
        return await verify(database, keys), keys

    verdict, keys = with_database(work)
    if verdict.wrong:
        raise CommandError(f"{verdict.wrong} ({verdict.events} events before it are as they were written)")
    said = f"{verdict.events} events are as they were written, {verdict.removed} went by age or number"
    print(f"{said}; {verdict.heads} signed heads fit, {verdict.waiting} events wait for the chain")
    for one in keys:
        print(f"the tower's key: {one}")
