"""The `tower-agent` command: reads its settings, reports an error in them in one line, and runs the agent."""

import asyncio
import logging
import os
import signal
import sys
import time
from collections.abc import Coroutine
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from onboard_agent.agent import Agent, AgentSettings
from onboard_agent.autopilot_port.schemes import help_text, make_port
from onboard_agent.check import check_all
from onboard_agent.link.enrolment import NotReached, check_can_keep
from onboard_agent.link.enrolment import enrol as enrol_here
from onboard_agent.link.identity_file import enrolment_token, read_identity, token_file_warning
from onboard_agent.link.tower_url import TowerUrl, parse_tower_url
from onboard_agent.sockets.uplinks import parse_uplinks
from onboard_agent.state_directory import state_directory
from onboard_agent.unusable import Unusable
from onboard_agent.video.camera_setting import NO_CAMERA, parse_camera
from onboard_agent.video.sources.schemes import help_text as camera_help

_log = logging.getLogger("onboard_agent")

UNUSABLE_EXIT_CODE: Final = 2
"""systemd does not restart the agent after this exit code (RestartPreventExitStatus)."""

ENROL_AGAIN_AFTER_S: Final = 1.0

app = typer.Typer(add_completion=False, no_args_is_help=True, help="The agent on a drone's companion computer.")

Tower = Annotated[
    str, typer.Option("--tower", envvar="TOWER_AGENT_TOWER", help="https://HOST[:PORT]; http:// for loopback only.")
]
Token = Annotated[Path, typer.Option("--token", envvar="TOWER_AGENT_TOKEN", help="File with the drone's key.")]
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
    """Link an autopilot to the tower until stopped."""
    try:
        _set_up_logging(log_level)
        address, port = parse_tower_url(tower), make_port(autopilot)
        _enrol_first(address, token)
        identity = read_identity(token, lambda drone_id: state_directory(state, drone_id))
        settings = AgentSettings(
            tower=address,
            identity=identity,
            port=port,
            uplinks=parse_uplinks(uplink or ()),
            camera=parse_camera(camera),
            log_level=log_level,
            state=state_directory(state, identity.drone_id),
        )
        warning = token_file_warning(token)
        if warning and identity.key is None:
            _log.warning("%s", warning)
        _run(_until_stopped(settings))
    except Unusable as error:
        typer.echo(f"tower-agent: {error}", err=True)
        raise typer.Exit(UNUSABLE_EXIT_CODE) from None


@app.command()
def check(
    tower: Tower,
    token: Token,
    autopilot: Autopilot,
    state: State = None,
    camera: Camera = NO_CAMERA,
    log_level: LogLevel = "error",
) -> None:
    """Test the key file, the tower, the key, the autopilot and the camera, and print which of them work."""
    try:
        _set_up_logging(log_level)
        if not _run(check_all(tower, token, autopilot, parse_camera(camera), lambda one: state_directory(state, one))):
            raise typer.Exit(1)
    except Unusable as error:
        typer.echo(f"tower-agent: {error}", err=True)
        raise typer.Exit(UNUSABLE_EXIT_CODE) from None


@app.command()
def enrol(
    tower: Annotated[str, typer.Argument(help="https://HOST[:PORT]", metavar="URL")],
    one_time_token: Annotated[str, typer.Argument(help="As an admin's console shows it.", metavar="TOKEN")],
    token: Annotated[
        Path, typer.Option("--token", envvar="TOWER_AGENT_TOKEN", help="Where the drone's key is to be kept.")
    ] = Path("/etc/tower-agent/token"),
    autopilot: Annotated[
        str, typer.Option("--autopilot", envvar="TOWER_AGENT_AUTOPILOT", help=f"Start at once. {help_text()}")
    ] = "",
    camera: Camera = NO_CAMERA,
    log_level: LogLevel = "info",
) -> None:
    """Make this drone's key, register its public half with a one-time token, and start or print how to start."""
    try:
        address = parse_tower_url(tower)
        if autopilot:
            make_port(autopilot)  # reports an error before the token is spent
        camera = parse_camera(camera)
        check_can_keep(token)
        drone = enrol_here(address, one_time_token, token)
    except Unusable as error:
        typer.echo(f"tower-agent: {error}", err=True)
        raise typer.Exit(UNUSABLE_EXIT_CODE) from None
    typer.echo(f"this is {drone} now; its key is in {token}")
    if autopilot:
        run(tower=tower, token=token, autopilot=autopilot, uplink=None, camera=camera, log_level=log_level)
        return
    typer.echo(f"start it:  tower-agent run --tower {address} --token {token} --autopilot WHERE")
    typer.echo("or, where the unit is installed:  systemctl enable --now tower-agent")


def _enrol_first(tower: TowerUrl, path: Path) -> None:
    """Replaces an enrolment token in the file with a key. Waits for the tower. Raises Unusable."""
    token = enrolment_token(path)
    if token is None:
        return
    check_can_keep(path)
    said = ""
    while True:
        try:
            _log.info("this is %s now; its key is in %s", enrol_here(tower, token, path), path)
            return
        except NotReached as error:
            if str(error) != said:
                said = str(error)
                _log.warning("not enrolled yet: %s", said)
            time.sleep(ENROL_AGAIN_AFTER_S)


async def _until_stopped(settings: AgentSettings) -> None:
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
    """Runs on uvloop if it is installed: a datagram then costs a sixth."""
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
    # journald adds the time
    form = "%(levelname)s %(message)s" if os.environ.get("JOURNAL_STREAM") else "%(asctime)s %(levelname)s %(message)s"
    logging.basicConfig(stream=sys.stderr, level=logging.WARNING, format=form)
    _log.setLevel(number)


def main() -> None:
    """Entry point of the console script."""
    app()
