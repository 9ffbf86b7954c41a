"""`tower user ...`: accounts from the command line. A running tower notices within a second."""

from __future__ import annotations

import json
import sys
from typing import Annotated, Any

import typer

from server.accounts.store import users
from server.accounts.store.password_policy import check_password
from server.accounts.store.passwords import generate_password
from server.accounts.store.tables import UserRow
from server.accounts.store.users import UserChange
from server.app.commands.session import CommandError, action_now, as_table, passwords_of, with_database
from server.kernel.people import Role
from server.runtime.settings import Settings
from server.storage.database import Database, DatabaseSession

app = typer.Typer(no_args_is_help=True, help="Users: who may sign in.")

Name = Annotated[str, typer.Argument(help="The user's name; upper and lower case do not count.", metavar="NAME")]
FromStdin = Annotated[
    bool, typer.Option("--password-stdin", help="Read the password from standard input instead of making one up.")
]

FirstPassword = Annotated[
    bool,
    typer.Option("--must-change/--for-good", help="Whether the user has to change this password at the first sign-in."),
]


@app.command("add")
def add_user(
    name: Name,
    role: Annotated[Role, typer.Option(help="admin, operator or observer.")] = Role.OPERATOR,
    password_stdin: FromStdin = False,
    first: FirstPassword = True,
) -> None:
    """Add a user, and print the generated password."""
    password = _password(name, from_stdin=password_stdin)

    async def work(database: Database, settings: Settings) -> UserRow:
        password_hash = await passwords_of(settings).hash(password)
        async with database.writing() as session:
            return await users.create_user(
                session,
                name=name,
                role=role,
                password_hash=password_hash,
                action=action_now(),
                must_change_password=first,
            )

    row = with_database(work)
    typer.echo(f"added {row.role} {row.name} (id {row.id})")
    if not password_stdin:
        typer.echo(f"password: {password}")


@app.command("list")
def list_users(
    as_json: Annotated[bool, typer.Option("--json", help="For programs: a JSON list.")] = False,
) -> None:
    """List every user."""

    async def work(database: Database, _settings: Settings) -> list[UserRow]:
        async with database.reading() as session:
            return await users.list_users(session)

    if as_json:
        typer.echo(json.dumps([_as_json(one) for one in with_database(work)]))
        return
    rows = [(one.id, one.name, one.role, _state(one)) for one in with_database(work)]
    typer.echo(as_table(("ID", "NAME", "ROLE", "STATE"), rows))


def _as_json(row: UserRow) -> dict[str, Any]:
    return {
        "id": row.id,
        "name": row.name,
        "role": row.role,
        "disabled": row.disabled,
        "first_password": row.password_changed_at is None,
        "must_change_password": row.must_change_password,
        "second_factor": row.has_second_factor,
    }


def _state(row: UserRow) -> str:
    states = {
        "disabled": row.disabled,
        "first password" if row.password_changed_at is None else "password of an admin": row.must_change_password,
        "second factor": row.has_second_factor,
    }
    return ", ".join(word for word, true in states.items() if true)


@app.command("password")
def set_password(name: Name, password_stdin: FromStdin = False, first: FirstPassword = True) -> None:
    """Set a user's password. Signs them out everywhere and ends their tokens."""
    password = _password(name, from_stdin=password_stdin)

    async def work(database: Database, settings: Settings) -> None:
        password_hash = await passwords_of(settings).hash(password)
        await _change(database, name, UserChange(password_hash=password_hash, must_change_password=first))

    with_database(work)
    typer.echo(f"{name} has another password and is signed out everywhere")
    if not password_stdin:
        typer.echo(f"password: {password}")


@app.command("second-factor-off")
def reset_second_factor(name: Name) -> None:
    """Remove lost codes and passkeys of a user. Signs them out everywhere and ends their tokens."""

    async def work(database: Database, _settings: Settings) -> None:
        async with database.writing() as session:
            found = await _found(session, name)
            await users.reset_second_factor(session, user_id=found.id, action=action_now())

    with_database(work)
    typer.echo(f"{name} signs in with the password alone")


@app.command("disable")
def disable_user(name: Name) -> None:
    """Prevent a user from signing in. Signs them out everywhere."""

    async def work(database: Database, _settings: Settings) -> None:
        await _change(database, name, UserChange(disabled=True))

    with_database(work)
    typer.echo(f"{name} is disabled")


@app.command("enable")
def enable_user(name: Name) -> None:
    """Let a disabled user sign in again."""

    async def work(database: Database, _settings: Settings) -> None:
        await _change(database, name, UserChange(disabled=False))

    with_database(work)
    typer.echo(f"{name} may sign in again")


async def _change(database: Database, name: str, change: UserChange) -> None:
    async with database.writing() as session:
        found = await _found(session, name)
        await users.change_user(session, user_id=found.id, change=change, action=action_now())


async def _found(session: DatabaseSession, name: str) -> UserRow:
    found = await users.find_user(session, name)
    if found is None:
        raise CommandError(f"there is no user named {name}")
    return found


def _password(name: str, *, from_stdin: bool) -> str:
    if not from_stdin:
        return generate_password()
    password = sys.stdin.readline().rstrip("\r\n")
    check_password(password, [name])
    return password
