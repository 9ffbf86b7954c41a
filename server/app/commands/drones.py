"""`tower drone ...`: the fleet from the command line. A running tower notices within a second."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from server.accounts.store.tables import UserRow
from server.accounts.store.users import find_user
from server.app.commands.session import CommandError, action_now, as_table, keep_secret, with_database
from server.fleet.store import drones, enrolments
from server.fleet.store.snapshot import load_snapshot
from server.fleet.store.tables import DroneRow
from server.kernel.fleet import DroneRecord, FleetSnapshot
from server.runtime.settings import Settings
from server.storage.database import Database, DatabaseSession
from wire.drone_key import fingerprint

app = typer.Typer(no_args_is_help=True, help="Drones: who is in the fleet, and who owns them.")

Which = Annotated[str, typer.Argument(help="The drone's name or its id.", metavar="NAME|ID")]
User = Annotated[str, typer.Argument(help="The user's name.", metavar="USER")]
TokenFile = Annotated[
    Path | None,
    typer.Option("--token-file", help="Write the token to this file (for its owner only) and do not print it."),
]
Hours = Annotated[float, typer.Option("--hours", min=0.02, max=168, help="So long the enrolment token is good.")]


@app.command("add")
def add_drone(
    name: Annotated[str, typer.Argument(help="The drone's name.", metavar="NAME")],
    owner: Annotated[list[str] | None, typer.Option(help="A user who may see and fly it; may be repeated.")] = None,
    token_file: TokenFile = None,
    hours: Hours = 1.0,
) -> None:
    """Add a drone, and print a token that enrols its agent, once."""

    async def work(database: Database, _settings: Settings) -> tuple[DroneRow, str]:
        async with database.writing() as session:
            row = await drones.create_drone(session, name=name, action=action_now())
            for one in owner or []:
                user = await _user(session, one)
                await drones.add_owner(session, drone_id=row.id, user_id=user.id, action=action_now())
            # Inside the transaction: a drone whose token could not be written is not added.
            return row, await _new_token(session, row.id, hours, token_file)

    row, token = with_database(work)
    typer.echo(f"added drone {row.name} (id {row.id})")
    _print_token(token, token_file)


@app.command("enrol")
def enrol_drone(drone: Which, token_file: TokenFile = None, hours: Hours = 1.0) -> None:
    """Print a token that enrols the drone's agent (again), once. Its present key stays valid until the token is
    used."""

    async def work(database: Database, _settings: Settings) -> str:
        async with database.writing() as session:
            found = await find_named(session, drone)
            return await _new_token(session, found.id, hours, token_file)

    _print_token(with_database(work), token_file)


@app.command("revoke")
def revoke_key(drone: Which) -> None:
    """Revoke the key or credential of the drone's agent. Its link ends; it must be enrolled again."""

    async def work(database: Database, _settings: Settings) -> str:
        async with database.writing() as session:
            found = await find_named(session, drone)
            return (await drones.revoke_key(session, drone_id=found.id, action=action_now())).name

    typer.echo(f"no agent can sign in as {with_database(work)} until one is enrolled")


@app.command("list")
def list_drones() -> None:
    """List every drone, its owners, and the identity of its agent."""

    async def work(database: Database, _settings: Settings) -> FleetSnapshot:
        async with database.reading() as session:
            return await load_snapshot(session)

    rows = [
        (one.id, one.name, ", ".join(owner.name for owner in one.owners), _identity(one))
        for one in with_database(work).drones
    ]
    typer.echo(as_table(("ID", "NAME", "OWNERS", "KEY"), rows))


@app.command("assign")
def assign_drone(drone: Which, user: User) -> None:
    """Let a user see and fly a drone."""
    typer.echo(f"{user} owns {_change_owner(drone, user, add=True)}")


@app.command("unassign")
def unassign_drone(drone: Which, user: User) -> None:
    """Remove a drone from a user's squad."""
    typer.echo(f"{user} does not own {_change_owner(drone, user, add=False)}")


def _change_owner(drone: str, user: str, *, add: bool) -> str:
    async def work(database: Database, _settings: Settings) -> str:
        async with database.writing() as session:
            row, owner = await find_named(session, drone), await _user(session, user)
            change = drones.add_owner if add else drones.remove_owner
            await change(session, drone_id=row.id, user_id=owner.id, action=action_now())
            return row.name

    return with_database(work)


async def find_named(session: DatabaseSession, which: str) -> DroneRow:
    """Finds a drone by name or id. Raises CommandError."""
    by_name = await drones.find_drone(session, which)
    by_id = await session.get(DroneRow, int(which)) if which.isascii() and which.isdigit() else None
    if by_name is not None and by_id is not None and by_name.id != by_id.id:
        raise CommandError(f"{which} is the name of one drone and the id of another: rename the first")
    found = by_name or by_id
    if found is None:
        raise CommandError(f"there is no drone {which}")
    return found


async def _user(session: DatabaseSession, name: str) -> UserRow:
    found = await find_user(session, name)
    if found is None:
        raise CommandError(f"there is no user named {name}")
    return found


async def _new_token(session: DatabaseSession, drone_id: int, hours: float, token_file: Path | None) -> str:
    _, _, token, _ = await enrolments.begin(session, drone_id=drone_id, lasts_s=hours * 3600, action=action_now())
    keep_secret(token, token_file)
    return token


def _identity(record: DroneRecord) -> str:
    if record.public_key:
        since = f", {record.key_since:%Y-%m-%d}" if record.key_since is not None else ""
        return f"{fingerprint(record.public_key)}{since}"
    return "a credential of an older version" if record.credential_hash else "none: not enrolled"


def _print_token(token: str, token_file: Path | None) -> None:
    typer.echo(f"enrolment token: {token}" if token_file is None else f"enrolment token written to {token_file}")
