"""The `tower-agent` command: reads its settings, reports an error in them in one line, and runs the agent.

argparse, because every package that the agent needs lies on each drone: typer would bring twelve more.
"""

from __future__ import annotations

import argparse
import asyncio
import logging
import os
import signal
import sys
import time
from collections.abc import Coroutine, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from onboard_agent import VERSION
from onboard_agent.agent import Agent, AgentSettings, StartAgain
from onboard_agent.autopilot_port.port import AutopilotPort
from onboard_agent.autopilot_port.schemes import make_port
from onboard_agent.autopilot_port.shared_line import share
from onboard_agent.command_line import command_line
from onboard_agent.link.enrolment import NotReached, check_can_keep
from onboard_agent.link.enrolment import enrol as enrol_here
from onboard_agent.link.identity_file import enrolment_token, read_identity, token_file_warning
from onboard_agent.link.tower_url import TowerUrl, parse_tower_url
from onboard_agent.settings import KEYS, parse_system_id, read_settings
from onboard_agent.signing.signed_port import with_signing
from onboard_agent.sockets.uplinks import parse_uplinks
from onboard_agent.state_directory import state_directory
from onboard_agent.unusable import Unusable
from onboard_agent.update.launch import launch, start_again, transaction_on_trial
from onboard_agent.update.release_keys import parse_release_keys
from onboard_agent.update.releases import Releases
from onboard_agent.video.camera_setting import NO_CAMERA, parse_camera

if TYPE_CHECKING:
    from onboard_agent.autonomy.core.lines import CameraSetting

_log = logging.getLogger("onboard_agent")

UNUSABLE_EXIT_CODE: Final = 2
"""systemd does not restart the agent after this exit code (RestartPreventExitStatus)."""

ENROL_AGAIN_AFTER_S: Final = 1.0


def run(found: dict[str, Any]) -> None:
    """Links an autopilot to the tower until stopped."""
    address, port = parse_tower_url(found["tower"]), make_port(found["autopilot"])
    system_id, also = parse_system_id(found["system_id"]), _also(found["also"] or ())
    if also and (system_id is None or system_id in also):
        raise Unusable("also: the first drone needs a system_id too, and each drone another one")
    token, state = Path(found["token"]), _path(found["state"])
    port, *ports = share(port, 1 + len(also)) if also else (port,)
    camera = _usable_camera(parse_camera(found["camera"]))
    _enrol_first(address, token)
    identity = read_identity(token, lambda drone_id: state_directory(state, drone_id))
    own_state = state_directory(state, identity.drone_id)
    signed, keys = with_signing(port, own_state, system_id)
    releases = Releases(own_state / "releases")
    launch(releases)
    settings = AgentSettings(
        tower=address,
        identity=identity,
        port=_with_payload(signed, found["servos"] or (), found["sensor"]),
        signing=(signed.line, keys),
        uplinks=parse_uplinks(found["uplinks"] or ()),
        camera=camera,
        log_level=found["log_level"],
        state=own_state,
        releases=releases,
        release_keys=parse_release_keys(found["release_keys"] or ()),
        on_trial=transaction_on_trial(os.environ),
        controllers=_controllers(found["controllers"] or ()),
        landing=_landing(found["landing_pad"], found["landing_camera"]),
        controller_cameras=_controller_cameras(found["controller_cameras"] or ()),
        system_id=system_id,
        neighbours=tuple(also),
        payload_release=_payload_release(found["payload_release"]),
        black_box_mb=parse_megabytes(found["black_box"]),
        black_box_hz=parse_black_box_hz(found["black_box_hz"]),
    )
    drones = [settings]
    for part, (other_system, other_token) in zip(ports, also.items(), strict=True):
        _enrol_first(address, other_token)
        identity = read_identity(other_token, lambda drone_id: state_directory(state, drone_id))
        other_state = state_directory(state, identity.drone_id)
        signed, keys = with_signing(part, other_state, other_system)
        drones.append(
            AgentSettings(
                tower=address,
                identity=identity,
                port=signed,
                signing=(signed.line, keys),
                uplinks=settings.uplinks,
                log_level=settings.log_level,
                state=other_state,
                black_box_mb=settings.black_box_mb,
                black_box_hz=settings.black_box_hz,
                system_id=other_system,
                neighbours=tuple(one for one in (system_id, *also) if one is not None and one != other_system),
                speaks_to_systemd=False,
            )
        )
    for file, drone in zip((token, *also.values()), drones, strict=True):
        warning = token_file_warning(file)
        if warning and drone.identity.key is None:
            _log.warning("%s", warning)
    try:
        _run(_until_stopped(drones))
    except StartAgain:
        start_again()


def check(found: dict[str, Any]) -> bool:
    """Tests the key file, the tower, the key, the autopilot and the camera. Returns whether all of them work."""
    from onboard_agent.check import check_all

    camera, state = parse_camera(found["camera"]), _path(found["state"])
    checked = check_all(
        found["tower"],
        Path(found["token"]),
        found["autopilot"],
        camera,
        lambda one: state_directory(state, one),
        system_id=parse_system_id(found["system_id"]),
    )
    return bool(_run(checked))


def doctor(found: dict[str, Any]) -> bool:
    """Tests every part separately, and says what to do about each that does not work."""
    from onboard_agent.doctor import examine

    return bool(_run(examine(found)))


def enrol(found: dict[str, Any], tower: str, one_time_token: str) -> None:
    """Makes this drone's key, registers its public half, and starts the agent or prints how to start it."""
    address, token, autopilot = parse_tower_url(tower), Path(found["token"]), found["autopilot"]
    if autopilot:
        make_port(autopilot)  # reports an error before the token is spent
    parse_camera(found["camera"])
    check_can_keep(token)
    drone = enrol_here(address, one_time_token, token)
    print(f"this is {drone} now; its key is in {token}", flush=True)
    if autopilot:
        run({**found, "tower": tower})
        return
    print(f"start it here:   tower-agent run --tower {address} --token {token} --autopilot WHERE")
    print(f"as a service:    tower-agent install --tower {address} --autopilot WHERE")


def _with_payload(port: AutopilotPort, servos: Sequence[str], sensor: str | None) -> AutopilotPort:
    if not servos and not sensor:
        return port
    from onboard_agent.payload.payload_port import with_payload  # not in the memory of every other agent
    from onboard_agent.payload.servo import parse_servos

    return with_payload(port, parse_servos(servos), sensor)


def parse_megabytes(text: str) -> int:
    """Raises Unusable."""
    if not (text.isascii() and text.isdigit() and len(text) <= 8):
        raise Unusable(f"black_box must be a number of megabytes, not {text!r}")
    return int(text)


def parse_black_box_hz(text: str) -> int:
    """Raises Unusable."""
    if not (text.isascii() and text.isdigit() and len(text) <= 3) or int(text) not in (0, *range(10, 101)):
        raise Unusable(f"black_box_hz must be 0, or 10 to 100, not {text!r}")
    return int(text)


def _usable_camera(camera: str) -> str:
    """A drone without the video libraries flies without video."""
    if camera != NO_CAMERA and find_spec("av") is None:
        from onboard_agent.installation import video_remedy  # not in the memory of every other agent

        _log.error("no video: its libraries are not installed. %s", video_remedy())
        return NO_CAMERA
    return camera


def _controllers(texts: Sequence[str]) -> Mapping[str, str]:
    if not texts:
        return {}
    from onboard_agent.autonomy.setting import parse_controllers  # not in the memory of every other agent

    return parse_controllers(texts)


def _landing(pad: str | None, camera: str | None) -> tuple[str, str] | None:
    if not pad and not camera:
        return None
    from onboard_agent.vision.pad_setting import parse_pad_setting

    setting = parse_pad_setting(pad or "", camera or "")
    parse_camera(setting.source)
    if find_spec("cv2") is None:
        from onboard_agent.installation import video_remedy

        _log.error("no precision landing: its libraries are not installed. %s", video_remedy())
        return None
    return pad or "", camera or ""


def _controller_cameras(texts: Sequence[str]) -> Sequence[CameraSetting]:
    if not texts:
        return ()
    from onboard_agent.autonomy.camera_settings import parse_cameras

    return parse_cameras(texts)


def _payload_release(text: str) -> str:
    if text != KEYS["payload_release"].default:
        from onboard_agent.autonomy.core.payload_release import parse_release

        parse_release(text)
    return text


def _also(texts: Sequence[str]) -> dict[int, Path]:
    """Returns the key files of the other drones on the line by their system ids."""
    found: dict[int, Path] = {}
    for text in texts:
        system, is_there, file = text.partition("=")
        number = parse_system_id(system)
        if not is_there or not file or number is None or number in found:
            raise Unusable(f"also {text!r}: each must be SYSTEM=FILE, and each system another one")
        found[number] = Path(file)
    return found


def _path(text: str | None) -> Path | None:
    return None if text is None else Path(text)


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


async def _until_stopped(drones: Sequence[AgentSettings]) -> None:
    """Runs an agent for each drone; SIGTERM and SIGINT end them at once and cleanly."""
    loop = asyncio.get_running_loop()
    running = asyncio.create_task(_run_all(drones))
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, running.cancel)
    try:
        await running
    except asyncio.CancelledError:
        _log.info("told to stop")


async def _run_all(drones: Sequence[AgentSettings]) -> None:
    """The first that ends ends all."""
    agents = [asyncio.create_task(Agent(one).run()) for one in drones]
    try:
        done, _ = await asyncio.wait(agents, return_when=asyncio.FIRST_COMPLETED)
        for agent in done:
            agent.result()
    finally:
        for agent in agents:
            agent.cancel()
        await asyncio.gather(*agents, return_exceptions=True)


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


def _command(said: argparse.Namespace) -> bool:
    """Carries out what the command line says. Returns whether all is well. Raises Unusable."""
    options = vars(said)
    if said.command == "install":
        from onboard_agent.install import install

        return install(options)
    if said.command == "uninstall":
        from onboard_agent.install import uninstall

        return uninstall(options)
    if said.command == "vision":
        from onboard_agent.vision.try_picture import try_picture

        return try_picture(options)
    if said.command == "enrol":
        options["token"] = options["token"] or os.environ.get("TOWER_AGENT_TOKEN") or "/etc/tower-agent/token"
        asked = {key: value for key, value in options.items() if key not in {"tower", "autopilot"}}
        found = read_settings(asked, os.environ, said.config)
        _set_up_logging(found["log_level"])
        # A file of settings is for the service: it does not start the agent here.
        autopilot = said.autopilot or os.environ.get("TOWER_AGENT_AUTOPILOT", "")
        enrol({**found, "autopilot": autopilot}, said.tower, said.one_time_token)
        return True
    found = read_settings(options, os.environ, said.config, complete=said.command != "doctor")
    _set_up_logging(found["log_level"] if said.command == "run" or said.log_level else "error")
    if said.command == "run":
        run(found)
        return True
    if said.command == "signing":
        from onboard_agent.signing.command import signing

        token, state = Path(found["token"]), _path(found["state"])
        identity = read_identity(token, lambda drone_id: state_directory(state, drone_id))
        signing(state_directory(state, identity.drone_id), show=said.show, take=said.take, forget=said.forget)
        return True
    return check(found) if said.command == "check" else doctor(found)


def main() -> None:
    """Entry point of the console script."""
    said = command_line(VERSION).parse_args()
    try:
        good = _command(said)
    except Unusable as error:
        print(f"tower-agent: {error}", file=sys.stderr)
        raise SystemExit(UNUSABLE_EXIT_CODE) from None
    if not good:
        raise SystemExit(1)
