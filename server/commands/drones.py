"""`tower drone ...`: the fleet from the command line. A running tower notices within a second."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.tables import UserRow
from server.accounts.users import find_user
from server.commands.session import CommandError, as_table, deed_now, keep_secret, with_database
from server.database import Database
from server.fleet import drones
from server.fleet.snapshot import FleetSnapshot, load_snapshot
from server.fleet.tables import DroneRow
from server.settings import Settings
from wire.credential import Credential

app = typer.Typer(no_args_is_help=True, help="Drones: who is in the fleet, and who owns them.")

Which = Annotated[str, typer.Argument(help="The drone's name or its id.", metavar="NAME|ID")]
User = Annotated[str, typer.Argument(help="The user's name.", metavar="USER")]
TokenFile = Annotated[
    Path | None,
    typer.Option("--token-file", help="Write the credential to this file (for its owner only) and do not print it."),
]


@app.command("add")
def add_drone(
    name: Annotated[str, typer.Argument(help="The drone's name.", metavar="NAME")],
    owner: Annotated[list[str] | None, typer.Option(help="A user who may see and fly it; may be repeated.")] = None,
    token_file: TokenFile = None,
) -> None:
    """Add a drone, and print the credential for its agent: it is told this once."""

    async def work(database: Database, _settings: Settings) -> tuple[DroneRow, Credential]:
        async with database.writing() as session:
            row, credential = await drones.create_drone(session, name=name, deed=deed_now())
            for one in owner or []:
                user = await _user(session, one)
                await drones.add_owner(session, drone_id=row.id, user_id=user.id, deed=deed_now())
            # Inside the transaction: a drone whose credential could not be kept is not added.
            keep_secret(str(credential), token_file)
            return row, credential

    row, credential = with_database(work)
    typer.echo(f"added drone {row.name} (id {row.id})")
    _tell(credential, token_file)


@app.command("list")
def list_drones() -> None:
    """List every drone and its owners."""

    async def work(database: Database, _settings: Settings) -> FleetSnapshot:
        async with database.reading() as session:
            return await load_snapshot(session)

    rows = [(one.id, one.name, ", ".join(owner.name for owner in one.owners)) for one in with_database(work).drones]
    typer.echo(as_table(("ID", "NAME", "OWNERS"), rows))


@app.command("assign")
def assign_drone(drone: Which, user: User) -> None:
    """Let a user see and fly a drone."""
    typer.echo(f"{user} owns {_change_owner(drone, user, add=True)}")


@app.command("unassign")
def unassign_drone(drone: Which, user: User) -> None:
    """Take a drone out of a user's squad."""
    typer.echo(f"{user} does not own {_change_owner(drone, user, add=False)}")


@app.command("credential")
def rotate_credential(drone: Which, token_file: TokenFile = None) -> None:
    """Make a new credential for a drone. The old one is worth nothing from then on."""

    async def work(database: Database, _settings: Settings) -> Credential:
        async with database.writing() as session:
            found = await _drone(session, drone)
            _, credential = await drones.rotate_credential(session, drone_id=found.id, deed=deed_now())
            keep_secret(str(credential), token_file)
            return credential

    _tell(with_database(work), token_file)


def _change_owner(drone: str, user: str, *, add: bool) -> str:
    async def work(database: Database, _settings: Settings) -> str:
        async with database.writing() as session:
            row, owner = await _drone(session, drone), await _user(session, user)
            change = drones.add_owner if add else drones.remove_owner
            await change(session, drone_id=row.id, user_id=owner.id, deed=deed_now())
            return row.name

    return with_database(work)


async def _drone(session: AsyncSession, which: str) -> DroneRow:
    by_name = await drones.find_drone(session, which)
    by_id = await session.get(DroneRow, int(which)) if which.isascii() and which.isdigit() else None
    if by_name is not None and by_id is not None and by_name.id != by_id.id:
        raise CommandError(f"{which} is the name of one drone and the id of another: rename the first")
    found = by_name or by_id
    if found is None:
        raise CommandError(f"there is no drone {which}")
    return found


async def _user(session: AsyncSession, name: str) -> UserRow:
    found = await find_user(session, name)
    if found is None:
        raise CommandError(f"there is no user named {name}")
    return found


def _tell(credential: Credential, token_file: Path | None) -> None:
    typer.echo(f"credential: {credential}" if token_file is None else f"credential written to {token_file}")
