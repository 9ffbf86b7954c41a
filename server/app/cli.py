"""The `tower` command. Every error is one line on standard error: what is wrong and what to do."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from server import VERSION
from server.app.commands import audit, drones, elevation, identify, moving, teams, tokens, towers, users
from server.app.commands.doctor import doctor
from server.app.commands.session import CommandError, settings_now, with_database
from server.fleet.store.tower_identity import forget_identity
from server.kernel.refusal import Refusal
from server.runtime.listening import CannotListen, address_in_words, listen
from server.runtime.settings import Settings, SettingsError
from server.runtime.vault import VaultError, new_key
from server.storage.database import Database, DatabaseError, DatabaseUnavailable
from server.storage.schema import DatabaseNotReady
from server.towers.io.bus_unavailable import BusUnavailable
from server.towers.store.tower_lock import TowerLockHeld

app = typer.Typer(
    name="tower",
    help="The control tower: serve it, and look after its users and drones.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(users.app, name="user")
app.add_typer(drones.app, name="drone")
app.add_typer(teams.app, name="team")
app.add_typer(tokens.app, name="token")
app.add_typer(audit.app, name="audit")


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(VERSION)
        raise typer.Exit


@app.callback()
def tower(
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    pass


@app.command("serve")
def serve(
    standby: Annotated[bool, typer.Option("--standby", help="Wait while another tower serves this database.")] = False,
) -> None:
    """Run the tower until it is stopped. Settings come from the environment: see docs/settings.md.

    In an empty folder it creates the database and prints the first admin's password.
    """
    from server.app.commands.first_start import create_database, in_words, is_first_start
    from server.app.log import configure_log
    from server.runtime.garbage import unsearched

    with unsearched():  # takes half a second to import, which the other commands do not need
        from server.app.composition import create_app
        from server.app.serving import run
        from server.link.api.tls_binding import require_certificate

    settings = settings_now()
    if settings.tls_certificate is not None:
        require_certificate(settings.tls_certificate)
    configure_log(settings.log_format)
    listener = listen(settings.host, settings.port)
    address = settings.public_url or address_in_words(listener)
    if not standby and is_first_start(settings) and (password := create_database(settings)):
        print(in_words(password), flush=True)
    app = create_app(settings)
    app.tower.lock.address = address
    if standby:
        print(f"Control Tower stands by at {address}", flush=True)
    run(
        app,
        listener,
        on_listening=lambda: print(f"Control Tower is at {address}", flush=True),
        standby=standby,
    )


app.command("doctor")(doctor)
moving.add_to(app)
towers.add_to(app)
identify.add_to(app)
elevation.add_to(app)


@app.command("new-key")
def print_new_key() -> None:
    """Print a key for TOWER_SECRET_KEYS, or for the key file. Changes nothing: see docs/deploy.md."""
    typer.echo(new_key())


@app.command("forget-identity")
def forget_tower_identity(
    sure: Annotated[bool, typer.Option("--every-drone-is-enrolled-anew", help="Say that you know.")] = False,
) -> None:
    """Give the tower a new identity at its next start, if the key that sealed the old one is lost.

    No drone then accepts this tower until the drone is enrolled again.
    """
    if not sure:
        raise CommandError("every drone must then be enrolled again: confirm with --every-drone-is-enrolled-anew")

    async def work(database: Database, _settings: Settings) -> None:
        async with database.writing() as session:
            await forget_identity(session)

    with_database(work)
    typer.echo("the tower gets a new identity when it is started")


@app.command("connect", add_help_option=False)
def connect() -> None:
    """Offer a drone as a local MAVLink endpoint to ordinary ground stations: see `tower connect --help`."""
    # Only for the list of commands: the console script calls the other package directly (server/app/entry.py).


def main() -> None:
    try:
        app()
    except SettingsError as error:
        _fail(str(error), 2)
    except (CommandError, Refusal, DatabaseNotReady, DatabaseUnavailable, CannotListen, VaultError) as error:
        _fail(str(error), 1)
    except (TowerLockHeld, BusUnavailable) as error:
        _fail(str(error), 1)
    except DatabaseError as error:
        _fail(f"the database refused: {str(error.orig).splitlines()[0]}", 1)
    except OSError as error:
        _fail(f"cannot go on: {error}", 1)


def _fail(words: str, code: int) -> None:
    print(f"tower: {words}", file=sys.stderr)
    raise SystemExit(code)
