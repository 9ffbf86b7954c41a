"""`tower-sim shell`, `tower-sim fly` and `tower-sim plot`: the flight controller without a ground station."""

from __future__ import annotations

import contextlib
import os
import select
import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from simulator import attached_terminal
from simulator.dataflash import HEAD
from simulator.firmware.controller import Fleet, FleetSettings
from simulator.firmware.fault_plan import FaultPlan
from simulator.firmware.flight_csv import FlightCsv
from simulator.firmware.shell import WAYS, Shell
from simulator.flight_log import HEADER, PERIOD_S, NotALog, open_new, read
from simulator.plots.dataflash_columns import columns_of
from simulator.plots.flight_plot import flight_picture

POLL_S = 0.05
MAX_BEHIND_S = 0.5
"""A machine that cannot keep up runs late."""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)

Faults = Annotated[
    list[str] | None,
    typer.Option(help="NAME[@FROM[-UNTIL]], in seconds since switch-on; names as of the command fault."),
]
Seed = Annotated[int, typer.Option(help="Of all that is random.")]
Period = Annotated[float, typer.Option(min=0.0, help="Between two lines of the log; 0 writes every step.")]
Wind = Annotated[float, typer.Option(min=0.0, max=30.0, help="m/s, with gusts of 15 %.")]


@app.command()
def shell(
    seed: Seed = 1,
    wind: Wind = 0.0,
    fault: Faults = None,
    attach: Annotated[Path | None, typer.Option(help="The socket that a running tower-sim --shell made.")] = None,
    log: Annotated[
        Path | None,
        typer.Option(help="Where the flight is written, as CSV; a file of before stays. Not with --attach."),
    ] = None,
    period_s: Period = PERIOD_S,
) -> None:
    """Commands for one flight controller, in real time; with --attach, for the vehicles of a running tower-sim.

    `help` lists them; the end of the input ends it."""
    if attach is not None:
        if log is not None:
            raise typer.BadParameter("the running tower-sim writes its logs: tower-sim --log FOLDER")
        try:
            attached_terminal.attach(attach)
        except OSError as error:
            typer.echo(f"tower-sim: {attach}: {error.strerror or error}", err=True)
            raise typer.Exit(1) from error
        return

    def make_fleet() -> Fleet:
        return Fleet(FleetSettings(seed=seed, wind_mps=wind, warm_start=False))

    terminal = Shell(make_fleet(), make_fleet, _plan_of(fault))
    with contextlib.ExitStack() as stack:
        if log is not None:
            file, writer = stack.enter_context(open_new(log)), FlightCsv(period_s=period_s)
            file.write(HEADER)
            terminal.on_step = lambda fleet: file.write(writer.note(fleet))
        _converse(terminal)


def _converse(terminal: Shell) -> None:
    """Until the input ends."""
    typer.echo("help lists the commands")
    waiting, last_s = b"", time.monotonic()
    while True:
        ready, _, _ = select.select([sys.stdin], [], [], POLL_S)
        now_s = time.monotonic()
        for line in terminal.advance(min(now_s - last_s, MAX_BEHIND_S)):
            typer.echo(line)
        last_s = now_s
        if not ready:
            continue
        data = os.read(sys.stdin.fileno(), 4096)
        if not data:
            return
        *lines, waiting = (waiting + data).split(b"\n")
        waiting = waiting[-4096:]
        for words in lines:
            answer = terminal.execute(words.decode("utf-8", "replace"))
            if answer:
                typer.echo(answer)
        last_s = time.monotonic()


@app.command()
def fly(
    way: Annotated[str, typer.Argument(help=f"One of {', '.join(WAYS)}.")],
    log: Annotated[Path, typer.Option(help="Where the flight is written, as CSV; a file of before stays.")],
    seconds: Annotated[float, typer.Option(min=1.0, max=3600.0)] = 60.0,
    period_s: Period = PERIOD_S,
    seed: Seed = 1,
    wind: Wind = 0.0,
    fault: Faults = None,
) -> None:
    """Fly one vehicle as fast as this machine can, and write its log."""
    if way not in WAYS:
        raise typer.BadParameter(f"one of {', '.join(WAYS)}")
    planned = _plan_of(fault)
    fleet = Fleet(FleetSettings(seed=seed, wind_mps=wind))
    fleet.boot()
    fleet.arm()
    path = WAYS[way]()
    writer, began_s = FlightCsv(period_s=period_s), fleet.now_s
    with open_new(log) as file:
        file.write(HEADER)
        while fleet.now_s < began_s + seconds:
            planned.apply(fleet)
            fleet.step(path.at(fleet.now_s - began_s))
            file.write(writer.note(fleet))
    typer.echo(f"{file.name}: {fleet.now_s - began_s:.0f} s, {fleet.commanders[0].state}")


def _plan_of(texts: list[str] | None) -> FaultPlan:
    try:
        return FaultPlan(texts or ())
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error


@app.command()
def plot(
    log: Annotated[Path, typer.Argument(help="A CSV log of tower-sim, or a log in ArduPilot's format.")],
    out: Annotated[Path, typer.Argument(help="The picture, SVG.")],
) -> None:
    """Draw a flight: path, height, attitude, estimate against truth, motors."""
    try:
        data = log.read_bytes()
        columns = columns_of(data) if data.startswith(HEAD) else read(data.decode("utf-8", "replace"))
    except (OSError, NotALog) as error:
        raise typer.BadParameter(str(error)) from error
    out.write_text(flight_picture(columns))
    typer.echo(str(out))
