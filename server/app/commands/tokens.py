"""`tower token ...`: API tokens from the command line. A running tower notices within a second."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path
from typing import Annotated

import typer

from server.accounts.store import tokens
from server.accounts.store.tables import ApiTokenRow, UserRow
from server.accounts.store.users import find_user
from server.app.commands.session import CommandError, action_now, as_table, keep_secret, with_database
from server.kernel.scopes import Scope
from server.runtime.settings import Settings
from server.storage.database import Database

app = typer.Typer(no_args_is_help=True, help="API tokens: how programs sign in for a user.")

User = Annotated[str, typer.Argument(help="The user's name.", metavar="USER")]


@app.command("add")
def add_token(
    user: User,
    name: Annotated[str, typer.Argument(help="What the token is for.", metavar="NAME")],
    scope: Annotated[list[Scope], typer.Option(help="What it may be used for; may be repeated.")],
    expires_days: Annotated[float | None, typer.Option(help="It ends after so many days; 90, if not given.")] = None,
    token_file: Annotated[
        Path | None, typer.Option("--token-file", help="Write the token to this file and do not print it.")
    ] = None,
) -> None:
    """Create a token for a user, and print it once."""

    async def work(database: Database, settings: Settings) -> tuple[ApiTokenRow, str]:
        async with database.writing() as session:
            action = action_now()
            ends = None
            if expires_days is not None:
                if not 0 < expires_days <= settings.token_longest_days:
                    raise tokens.BadExpiry(f"a token lives for up to {settings.token_longest_days} days")
                ends = action.at + timedelta(days=expires_days)
            owner = await find_user(session, user)
            if owner is None:
                raise CommandError(f"there is no user named {user}")
            row, secret = await tokens.create_token(
                session,
                owner=owner,
                name=name,
                scopes=scope,
                expires_at=ends,
                action=action,
                longest=timedelta(days=settings.token_longest_days),
            )
            # Inside the transaction: a token that could not be written is not created.
            keep_secret(secret, token_file)
            return row, secret

    row, secret = with_database(work)
    typer.echo(f"added token {row.name} (id {row.id}) for {user}: {row.scopes}")
    typer.echo(f"token: {secret}" if token_file is None else f"token written to {token_file}")


@app.command("list")
def list_tokens() -> None:
    """List every token and what it is for."""

    async def work(database: Database, _settings: Settings) -> list[tuple[ApiTokenRow, UserRow]]:
        async with database.reading() as session:
            return [one async for one in tokens.list_tokens(session)]

    rows = [
        (
            row.id,
            row.name,
            owner.name,
            row.scopes.replace(" ", ","),
            _moment(row.expires_at),
            _moment(row.last_used_at),
            row.last_used_address,
        )
        for row, owner in with_database(work)
    ]
    typer.echo(as_table(("ID", "NAME", "USER", "SCOPES", "ENDS", "LAST USED", "FROM"), rows))


@app.command("revoke")
def revoke_token(
    token_id: Annotated[int, typer.Argument(help="The token's id, as listed.", metavar="ID")],
) -> None:
    """Revoke a token. Connections that use it are closed."""

    async def work(database: Database, _settings: Settings) -> None:
        async with database.writing() as session:
            await tokens.revoke_token(session, token_id=token_id, of_user=None, action=action_now())

    with_database(work)
    typer.echo(f"token {token_id} is revoked")


def _moment(at: object) -> str:
    return "never" if at is None else f"{at:%Y-%m-%d %H:%M}Z"
