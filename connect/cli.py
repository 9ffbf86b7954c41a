"""The command line of `tower connect`. Every error is one line on standard error; the exit code tells the kind.

0: ended by the user. 1: the tower was unreachable at the start, or the controls were not available. 2: invalid input
(an option, the token, the drone's name, a port in use), so that a retry will not help.
"""

import asyncio
import signal
import sys
from collections.abc import Coroutine
from pathlib import Path
from typing import Annotated, Any

import typer

from connect.addresses import DEFAULT_UDP, endpoints_of
from connect.session import Options, run
from connect.tower_url import parse_tower_url
from connect.unusable import Ended, Unusable

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def connect(
    drones: Annotated[list[str], typer.Argument(help="A drone's name or its id, each.", metavar="DRONE...")],
    tower: Annotated[
        str, typer.Option("--tower", envvar="TOWER_URL", help="https://HOST[:PORT]; http:// on this machine only.")
    ],
    token: Annotated[
        str, typer.Option("--token", envvar="TOWER_TOKEN", help="The API token; better in TOWER_TOKEN or a file.")
    ] = "",
    token_file: Annotated[
        Path | None, typer.Option("--token-file", envvar="TOWER_TOKEN_FILE", help="A file with the API token.")
    ] = None,
    udp: Annotated[
        list[str] | None, typer.Option("--udp", help=f"Send to a program that listens there [{DEFAULT_UDP}].")
    ] = None,
    udp_listen: Annotated[
        list[str] | None, typer.Option("--udp-listen", help="Wait there for programs that speak first.")
    ] = None,
    tcp: Annotated[list[str] | None, typer.Option("--tcp", help="Wait there for programs to connect.")] = None,
    fly: Annotated[
        bool, typer.Option("--fly", help="Take control of the first drone, and release it at the end.")
    ] = False,
    acknowledge_loss_check: Annotated[
        bool, typer.Option("--acknowledge-loss-check", help="With --fly: read out what a loss would do, and ask.")
    ] = False,
    other_machines: Annotated[
        bool, typer.Option("--other-machines", help="Allow addresses that are not on this machine.")
    ] = False,
) -> None:
    """Drones of the tower as a local MAVLink endpoint, for QGroundControl, Mission Planner, MAVProxy, MAVSDK.

    Several drones are systems 1, 2, 3, in the order named. Without --fly they can be watched only. Each of --udp,
    --udp-listen and --tcp may be repeated.

    With --fly, type acquire, release or accept (of several drones: with the name) to change hands.
    """
    options = Options(
        drones=drones,
        tower=parse_tower_url(tower),
        token=_token(token, token_file),
        endpoints=endpoints_of(
            udp=udp or [], udp_listen=udp_listen or [], tcp=tcp or [], other_machines=other_machines
        ),
        fly=fly,
        acknowledge_loss_check=acknowledge_loss_check,
    )
    if acknowledge_loss_check and not fly:
        raise Unusable("--acknowledge-loss-check goes with --fly: only whoever has the controls can acknowledge it")
    _run(_until_stopped(options))


def _token(token: str, token_file: Path | None) -> str:
    if token_file is not None and not token:
        try:
            token = token_file.read_text()
        except (OSError, UnicodeDecodeError) as error:
            raise Unusable(f"the token file {token_file} cannot be read: {error}") from None
    token = token.strip()
    if not token:
        raise Unusable("an API token is needed: TOWER_TOKEN, --token-file or --token (see docs/tokens.md)")
    if not token.isascii() or not token.isprintable() or " " in token:
        raise Unusable("this is not an API token: it has the form twt_ and 43 characters")
    return token


async def _until_stopped(options: Options) -> None:
    loop = asyncio.get_running_loop()
    running = asyncio.create_task(run(options, _say))
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, running.cancel)
    try:
        await running
    except asyncio.CancelledError:
        _say("ended")


def _run(main: Coroutine[Any, Any, None]) -> None:
    """Runs on uvloop if installed: a datagram then costs a sixth."""
    try:
        from uvloop import new_event_loop
    except ImportError:
        asyncio.run(main)
        return
    with asyncio.Runner(loop_factory=new_event_loop) as runner:
        runner.run(main)


def _say(words: str) -> None:
    print(words, flush=True)


def main(arguments: list[str] | None = None) -> None:
    """Runs `tower connect ...`: `arguments` follow `connect`. None: it is `tower-connect`, the same program alone."""
    program = "tower-connect" if arguments is None else "tower connect"
    try:
        app(args=sys.argv[1:] if arguments is None else arguments, prog_name=program)
    except Ended as ended:
        print(f"{program}: {ended}", file=sys.stderr)
        raise SystemExit(ended.exit_code) from None
