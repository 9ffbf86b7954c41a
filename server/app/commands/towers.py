"""`tower towers`, `tower drain`, `tower bus-certificate`: several towers of one database."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path
from typing import Annotated, Final

import typer

from server.app.commands.session import CommandError, action_now, as_table, with_database
from server.kernel.clock import utc_now
from server.runtime.settings import Settings
from server.storage.database import Database
from server.towers.store.draining import RunningTower, ask_to_drain, running_towers

LOOK_EVERY_S: Final = 0.3


def add_to(app: typer.Typer) -> None:
    app.command("towers")(list_towers)
    app.command("drain")(drain)
    app.command("bus-certificate")(bus_certificate)


def list_towers() -> None:
    """List the running towers that share this database."""

    async def work(database: Database, _settings: Settings) -> list[RunningTower]:
        async with database.reading() as session:
            return await running_towers(session)

    rows = [
        (one.name, one.address, one.url or "-", f"{one.host}/{one.pid}", one.doing or ("ends" if one.draining else "-"))
        for one in with_database(work)
    ]
    typer.echo(as_table(("tower", "address", "own url", "process", "ends its work"), rows))


def drain(
    tower: Annotated[str, typer.Argument(help="Its name as in `tower towers`, or its address.", metavar="TOWER")],
    within_s: Annotated[
        float, typer.Option("--within", min=1, help="Give up waiting after this many seconds; the tower goes on.")
    ] = 3600.0,
) -> None:
    """Let one of several towers end its work: its drones and browsers move to the others, then it exits.

    Drones that are flown by hand move last, without a gap in the pilot's sticks. Prints how far it is.
    """

    async def work(database: Database, _settings: Settings) -> None:
        async with database.writing() as session:
            asked = await ask_to_drain(session, tower, action_now())
        typer.echo(f"{asked.name} at {asked.address} ends its work")
        said, ends_at = "", time.monotonic() + within_s
        while True:
            async with database.reading() as session:
                left = next((one for one in await running_towers(session) if one.tower == asked.tower), None)
            if left is None:
                break
            if left.doing != said:
                said = left.doing
                typer.echo(said)
            if time.monotonic() > ends_at:
                raise CommandError(f"{asked.name} has not ended within {within_s:.0f} s and goes on: {said}")
            await asyncio.sleep(LOOK_EVERY_S)
        typer.echo(f"{asked.name} has ended")

    with_database(work)


def bus_certificate(
    folder: Annotated[Path, typer.Argument(help="Where NATS finds it.", metavar="FOLDER")],
    names: Annotated[list[str], typer.Argument(help="Host names and addresses of the NATS server.", metavar="NAME...")],
) -> None:
    """Make a certificate for the NATS server of several towers, for ten years: see docs/how-to/several-towers.md.

    Leaves one of the same names that is valid for another year.
    """
    from server.towers.io.bus_certificate import AUTHORITY, is_valid, write_certificate

    now = utc_now()
    if is_valid(folder, names, now):
        typer.echo(f"{folder} has a certificate already")
        return
    write_certificate(folder, names, now)
    typer.echo(f"NATS needs bus.pem and bus.key of {folder}, each tower TOWER_BUS_AUTHORITY={folder / AUTHORITY}")
