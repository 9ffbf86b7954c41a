"""`tower team ...`: teams from the command line. A running tower notices within a second."""

from __future__ import annotations

from typing import Annotated

import typer

from server.accounts.store.users import find_user
from server.app.commands.drones import find_named
from server.app.commands.session import CommandError, action_now, as_table, with_database
from server.kernel.relations import TeamRole
from server.runtime.settings import Settings
from server.storage.database import Database, DatabaseSession
from server.teams.store import teams
from server.teams.store.tables import TeamRow
from server.teams.store.teams import COMMAND_LINE
from server.teams.store.views import TeamView, views_of

app = typer.Typer(no_args_is_help=True, help="Teams: people and drones that belong together.")

Which = Annotated[str, typer.Argument(help="The team's name or its id.", metavar="TEAM|ID")]


@app.command("add")
def add_team(
    name: Annotated[str, typer.Argument(help="The team's name.", metavar="NAME")],
    admin: Annotated[list[str] | None, typer.Option(help="A user who leads it; may be repeated.")] = None,
) -> None:
    """Create a team."""

    async def work(database: Database, _settings: Settings) -> TeamRow:
        async with database.writing() as session:
            row = await teams.make_team(session, name=name, manager=COMMAND_LINE, action=action_now())
            for one in admin or []:
                await _set_role(session, row, one, TeamRole.ADMIN)
            return row

    row = with_database(work)
    typer.echo(f"added team {row.name} (id {row.id})")


@app.command("list")
def list_teams() -> None:
    """List every team with its people and drones."""

    async def work(database: Database, _settings: Settings) -> list[TeamView]:
        async with database.reading() as session:
            rows = await teams.list_teams(session, COMMAND_LINE)
            return await views_of(session, rows, COMMAND_LINE, action_now().at)

    rows: list[tuple[object, ...]] = [
        (
            one.id,
            one.name,
            ", ".join(f"{member.user.name} ({member.role.value})" for member in one.members),
            ", ".join(drone.name for drone in one.drones),
        )
        for one in with_database(work)
    ]
    typer.echo(as_table(("ID", "NAME", "PEOPLE", "DRONES"), rows))


@app.command("member")
def set_member(
    team: Which,
    user: Annotated[str, typer.Argument(help="The user's name.", metavar="USER")],
    role: Annotated[TeamRole | None, typer.Argument(help="What they are in the team.")] = None,
    remove: Annotated[bool, typer.Option("--remove", help="Take them out of the team.")] = False,
) -> None:
    """Add a user to a team, change their role, or remove them."""
    if remove == (role is not None):
        raise CommandError("say either a role (observer, operator, admin) or --remove")

    async def work(database: Database, _settings: Settings) -> str:
        async with database.writing() as session:
            row = await _team(session, team)
            if role is not None:
                await _set_role(session, row, user, role)
                return f"{user} is {role.value} in {row.name}"
            found = await find_user(session, user)
            if found is None:
                raise CommandError(f"there is no user named {user}")
            await teams.remove_member(session, row.id, user_id=found.id, manager=COMMAND_LINE, action=action_now())
            return f"{user} is not in {row.name}"

    typer.echo(with_database(work))


@app.command("drone")
def set_drone(
    team: Which,
    drone: Annotated[str, typer.Argument(help="The drone's name or its id.", metavar="DRONE|ID")],
    remove: Annotated[bool, typer.Option("--remove", help="Take the drone out of the team.")] = False,
) -> None:
    """Add a drone to a team, or remove it."""

    async def work(database: Database, _settings: Settings) -> str:
        async with database.writing() as session:
            row, found = await _team(session, team), await find_named(session, drone)
            change = teams.remove_drone if remove else teams.add_drone
            await change(session, row.id, drone_id=found.id, manager=COMMAND_LINE, action=action_now())
            return f"{found.name} is {'not ' if remove else ''}in {row.name}"

    typer.echo(with_database(work))


async def _set_role(session: DatabaseSession, team: TeamRow, user: str, role: TeamRole) -> None:
    found = await find_user(session, user)
    if found is None:
        raise CommandError(f"there is no user named {user}")
    await teams.set_role(session, team.id, user_id=found.id, role=role, manager=COMMAND_LINE, action=action_now())


async def _team(session: DatabaseSession, which: str) -> TeamRow:
    number = int(which) if which.isascii() and which.isdigit() and len(which) < 11 else None
    found = {row.id: row for row in await teams.find_teams(session, name=which, team_id=number)}
    if not found:
        raise CommandError(f"there is no team {which}")
    if len(found) > 1:
        raise CommandError(f"{which} is more than one team: say its id ({', '.join(str(one) for one in found)})")
    return next(iter(found.values()))
