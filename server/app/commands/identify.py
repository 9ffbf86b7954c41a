"""`tower identify`: the step responses of a drone from the CSV of its black box, or from a telemetry log."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from server.app.commands.session import CommandError
from server.flights.core.tlog import of_one_vehicle, read_entries


def add_to(app: typer.Typer) -> None:
    app.command("identify")(identify_file)


def identify_file(
    file: Annotated[Path, typer.Argument(help="CSV of a black box, or a .tlog.", exists=True, dir_okay=False)],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Print how fast a drone did what its sticks said: gain, time constant and delay of roll, pitch, yaw and climb.

    Needs no running tower and changes nothing: see docs/statistics.md.
    """
    from server.identification.core.axes import AXES, NoColumns, identify, table_of_csv, table_of_tlog  # loads NumPy

    try:
        if file.suffix.lower() == ".csv":
            with file.open(encoding="utf-8", newline="") as lines:
                table = table_of_csv(lines)
        else:
            with file.open("rb") as log:
                table = table_of_tlog(of_one_vehicle(read_entries(log)))
    except (NoColumns, UnicodeDecodeError) as error:
        raise CommandError(str(error)) from None
    if not table.rows:
        raise CommandError("the file has no attitude of an autopilot")
    found = identify(table)
    if as_json:
        about = {
            name: None if one is None else asdict(one) | {"rise_s": one.rise_s, "is_patterned": one.is_patterned}
            for name, one in found.items()
        }
        typer.echo(json.dumps(about, indent=2))
        return
    typer.echo("axis   manoeuvres  gain            time constant  delay    rise     r²")
    for axis in AXES:
        one = found[axis.name]
        if one is None:
            typer.echo(f"{axis.name:6} {'none':>10}")
            continue
        gain = f"{one.gain:.2f} {axis.unit}"
        bound = "  at the bound of the search" if one.at_bound else ""
        typer.echo(
            f"{axis.name:6} {one.manoeuvres:10d}  {gain:14}  {one.tau_s:9.3f} s  "
            f"{one.delay_s:6.3f} s {one.rise_s:7.3f} s  {one.r_squared:.2f}{bound}"
        )
        if one.is_patterned:
            typer.echo(
                f"       {axis.name}: what the model leaves is no noise (correlation {one.residual_correlation:.2f}): "
                "the drone acts as a system of higher order, or something else moved it"
            )
