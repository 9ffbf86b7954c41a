"""The command `tower-agent`: reads its settings, says in one line what is wrong with them, and runs."""

import asyncio
import logging
import os
import signal
import sys
from collections.abc import Coroutine
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from onboard_agent.agent import Agent, AgentSettings
from onboard_agent.autopilot_port.schemes import help_text, make_port
from onboard_agent.check import check_all
from onboard_agent.enrolment import check_can_keep, fetch_credential, keep_credential
from onboard_agent.state_directory import state_directory
from onboard_agent.token_file import read_token, token_file_warning
from onboard_agent.tower_url import parse_tower_url
from onboard_agent.unusable import Unusable
from onboard_agent.uplinks import parse_uplinks
from onboard_agent.video.camera_setting import NO_CAMERA, parse_camera
from onboard_agent.video.sources.schemes import help_text as camera_help

_log = logging.getLogger("onboard_agent")

UNUSABLE_EXIT_CODE: Final = 2
"""systemd does not restart the agent after this one (RestartPreventExitStatus)."""

app = typer.Typer(add_completion=False, no_args_is_help=True, help="The agent on a drone's companion computer.")

Tower = Annotated[
    str, typer.Option("--tower", envvar="TOWER_AGENT_TOWER", help="https://HOST[:PORT]; http:// for loopback only.")
]
Token = Annotated[Path, typer.Option("--token", envvar="TOWER_AGENT_TOKEN", help="File with the drone's credential.")]
Autopilot = Annotated[str, typer.Option("--autopilot", envvar="TOWER_AGENT_AUTOPILOT", help=help_text())]
Uplinks = Annotated[
    list[str] | None,
    typer.Option(
        "--uplink",
        envvar="TOWER_AGENT_UPLINKS",
        help="A way out, by the name of its interface or a local address. Several: each datagram goes by all of them.",
    ),
]
State = Annotated[
    Path | None,
    typer.Option(
        "--state",
        envvar=["TOWER_AGENT_STATE", "STATE_DIRECTORY"],
        help="Folder for what must outlast the agent. Default: ~/.local/state/tower-agent.",
    ),
]
Camera = Annotated[
    str,
    typer.Option("--camera", envvar="TOWER_AGENT_CAMERA", help=f"{NO_CAMERA} (default); {camera_help()}"),
]
LogLevel = Annotated[
    str, typer.Option("--log-level", envvar="TOWER_AGENT_LOG_LEVEL", help="debug, info, warning or error.")
]


@app.command()
def run(
    tower: Tower,
    token: Token,
    autopilot: Autopilot,
    uplink: Uplinks = None,
    state: State = None,
    camera: Camera = NO_CAMERA,
    log_level: LogLevel = "info",
) -> None:
    """Link an autopilot with the tower, until told to stop."""
    try:
        _set_up_logging(log_level)
        credential = read_token(token)
        settings = AgentSettings(
            tower=parse_tower_url(tower),
            credential=credential,
            port=make_port(autopilot),
            uplinks=parse_uplinks(uplink or ()),
            camera=parse_camera(camera),
            log_level=log_level,
            state=state_directory(state, credential.drone_id),
        )
        warning = token_file_warning(token)
        if warning:
            _log.warning("%s", warning)
        _run(_until_told_to_stop(settings))
    except Unusable as error:
        typer.echo(f"tower-agent: {error}", err=True)
        raise typer.Exit(UNUSABLE_EXIT_CODE) from None


@app.command()
def check(
    tower: Tower, token: Token, autopilot: Autopilot, camera: Camera = NO_CAMERA, log_level: LogLevel = "error"
) -> None:
    """Say what works: the token, the tower, the credential, the autopilot, the camera."""
    try:
        _set_up_logging(log_level)
        if not _run(check_all(tower, token, autopilot, parse_camera(camera))):
            raise typer.Exit(1)
    except Unusable as error:
        typer.echo(f"tower-agent: {error}", err=True)
        raise typer.Exit(UNUSABLE_EXIT_CODE) from None


@app.command()
def enrol(
    tower: Annotated[str, typer.Argument(help="https://HOST[:PORT]", metavar="URL")],
    enrolment_token: Annotated[str, typer.Argument(help="As an admin's console shows it.", metavar="TOKEN")],
    token: Annotated[
        Path, typer.Option("--token", envvar="TOWER_AGENT_TOKEN", help="Where the credential is to be kept.")
    ] = Path("/etc/tower-agent/token"),
    autopilot: Annotated[
        str, typer.Option("--autopilot", envvar="TOWER_AGENT_AUTOPILOT", help=f"Start at once. {help_text()}")
    ] = "",
    camera: Camera = NO_CAMERA,
    log_level: LogLevel = "info",
) -> None:
    """Fetch this drone's credential with a one-time token, keep it, and start or say how to."""
    try:
        address = parse_tower_url(tower)
        if autopilot:
            make_port(autopilot)  # what is wrong with it is said before the token is spent
        camera = parse_camera(camera)
        check_can_keep(token)
        credential, drone = fetch_credential(address, enrolment_token)
        keep_credential(token, credential)
    except Unusable as error:
        typer.echo(f"tower-agent: {error}", err=True)
        raise typer.Exit(UNUSABLE_EXIT_CODE) from None
    typer.echo(f"this is {drone} now; its credential is in {token}")
    if autopilot:
        run(tower=tower, token=token, autopilot=autopilot, uplink=None, camera=camera, log_level=log_level)
        return
    typer.echo(f"start it:  tower-agent run --tower {address} --token {token} --autopilot WHERE")
    typer.echo("or, where the unit is installed:  systemctl enable --now tower-agent")


async def _until_told_to_stop(settings: AgentSettings) -> None:
    """Runs the agent; SIGTERM and SIGINT end it at once and cleanly."""
    loop = asyncio.get_running_loop()
    running = asyncio.create_task(Agent(settings).run())
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, running.cancel)
    try:
        await running
    except asyncio.CancelledError:
        _log.info("told to stop")


def _run(main: Coroutine[Any, Any, Any]) -> Any:
    """On uvloop where there is one: a sixth of the cost of a datagram."""
    try:
        from uvloop import new_event_loop
    except ImportError:
        return asyncio.run(main)
    with asyncio.Runner(loop_factory=new_event_loop) as runner:
        return runner.run(main)


def _set_up_logging(level: str) -> None:
    number = logging.getLevelNamesMapping().get(level.upper())
    if number is None:
        raise Unusable(f"the log level {level!r} is none of debug, info, warning, error")
    # journald puts the time in front by itself
    form = "%(levelname)s %(message)s" if os.environ.get("JOURNAL_STREAM") else "%(asctime)s %(levelname)s %(message)s"
    logging.basicConfig(stream=sys.stderr, level=logging.WARNING, format=form)
    _log.setLevel(number)


def main() -> None:
    """The console script."""
    app()
