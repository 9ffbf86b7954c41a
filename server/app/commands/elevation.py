"""`tower elevation`: makes the elevation of the map from a GeoTIFF."""

from __future__ import annotations

import asyncio
import re
import sys
from pathlib import Path
from typing import Annotated

import typer

from server.app.commands.session import CommandError, action_now, with_database
from server.maps.io.map_files import NAME
from server.runtime.settings import Settings
from server.storage.database import Database


def add_to(app: typer.Typer) -> None:
    app.command("elevation")(add_elevation_file)


def add_elevation_file(
    file: Annotated[Path, typer.Argument(help="GeoTIFF with heights of the ground.", exists=True, dir_okay=False)],
    name: Annotated[
        str, typer.Option(help="Of the map file: small letters, digits, - and _. Default: the file's.")
    ] = "",
    attribution: Annotated[str, typer.Option(help="Whom the map credits, as the terms of the data ask.")] = "",
) -> None:
    """Put the heights of a GeoTIFF on the map, as a file of TOWER_MAPS. A running tower needs no restart.

    A map file of the same name is replaced: see docs/maps.md.
    """
    from server.maps.io.elevation.converted import Converted
    from server.maps.io.elevation.converting import add_elevation
    from server.maps.io.elevation.refusals import BadElevationFile

    name = name or re.sub(r"[^a-z0-9_-]+", "-", file.stem.lower()).strip("-_")[:80]
    if not NAME.fullmatch(name):
        raise CommandError("give it a --name of small letters, digits, - and _")

    async def work(database: Database, settings: Settings) -> Converted:
        found = await asyncio.to_thread(
            add_elevation,
            file,
            settings.maps,
            name,
            title=file.stem,
            attribution=attribution,
            max_bytes=settings.map_file_largest_mb * 1_000_000,
            report=_progress,
        )
        async with database.writing() as session:
            action_now().record(session, "map.file_added", file=name, bytes=found.bytes)
        return found

    try:
        found = with_database(work)
    except BadElevationFile as error:
        raise CommandError(f"{file.name} {error}") from None
    finally:
        if sys.stderr.isatty():
            print(file=sys.stderr)
    typer.echo(f"{name}: {found.tiles} tiles up to zoom {found.zoom}, {found.bytes / 1e6:.1f} MB")


def _progress(share: float) -> None:
    if sys.stderr.isatty():
        print(f"\r{share:4.0%}", end="", file=sys.stderr, flush=True)
