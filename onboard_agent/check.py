"""`tower-agent check`: tests each part separately and prints which parts work."""

import asyncio
import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import Final

from onboard_agent.autopilot.answers import TIMESYNC, Answers, may_answer
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.autopilot_port.port import AutopilotPort
from onboard_agent.autopilot_port.schemes import make_port
from onboard_agent.link.identity_file import read_identity, token_file_warning
from onboard_agent.link.tower_url import parse_tower_url
from onboard_agent.onboard import Onboard
from onboard_agent.signing.signed_port import SignedPort, with_signing
from onboard_agent.sockets.control_channel import NoLink, try_sign_in
from onboard_agent.state_directory import state_directory
from onboard_agent.unusable import Unusable
from onboard_agent.video.camera_setting import NO_CAMERA
from onboard_agent.video.trial import try_camera
from wire.dialect import decode
from wire.frame_stream import FrameStream
from wire.frames import message_id
from wire.ids import DroneId
from wire.own_system import OwnSystem
from wire.signing_key import Signing

LISTEN_S: Final = 5.0
"""An autopilot sends something at least once a second."""

OTHERS_S: Final = 2.2
"""Another autopilot counts once the own one was heard beside it, and each sends a heartbeat a second."""


async def check_all(
    tower: str,
    token: Path,
    autopilot: str,
    camera: str = NO_CAMERA,
    state_of: Callable[[DroneId], Path] = lambda drone_id: state_directory(None, drone_id),
    *,
    system_id: int | None = None,
) -> bool:
    """Prints one line for each part. Returns True if all of them work. Raises Unusable if no part can be tested."""
    url, port = parse_tower_url(tower), make_port(autopilot)
    identity = read_identity(token, state_of)
    warning = token_file_warning(token) if identity.key is None else None
    _say(warning is None, warning or f"the token file is that of drone {identity.drone_id}")
    good = True
    signed, _ = with_signing(port, state_of(identity.drone_id), system_id)
    try:
        # Requests no link, so that an agent that is flying now keeps its own.
        _say(True, f"{url} accepts {await try_sign_in(url, identity)}")
    except NoLink as error:
        good = _say(False, str(error))
    try:
        heard = await listen(signed, system_id)
        good = _say(heard is not None, heard or not_heard(signed)) and good
    except Unusable as error:
        good = _say(False, f"{error} (is the agent running?)")
    if camera != NO_CAMERA:
        good = _say(*await try_camera(camera, url)) and good
    return good


async def listen(port: AutopilotPort, system_id: int | None = None) -> str | None:
    """Returns what was heard of the autopilot and of others on its line, or None. Raises Unusable."""
    loop = asyncio.get_running_loop()
    onboard = Onboard(now=loop.time(), speaks_first=port.speaks_first, own=OwnSystem(only=system_id, now=loop.time()))
    stream = FrameStream()
    heard = asyncio.Event()

    answers = Answers(FrameMaker())

    def received(data: bytes) -> None:
        frames = stream.feed(data)
        onboard.from_autopilot(frames, loop.time())
        for frame in frames:
            if message_id(frame) == TIMESYNC and (message := decode(frame)) is not None:
                answers.timesync(message, loop.time())
        if onboard.autopilot.heard:
            heard.set()

    running = asyncio.create_task(port.run(received))
    waiting = asyncio.create_task(heard.wait())
    greeting = asyncio.create_task(_greet(port, onboard)) if port.speaks_first else None
    try:
        await asyncio.wait({running, waiting}, timeout=LISTEN_S, return_when=asyncio.FIRST_COMPLETED)
        if running.done():
            running.result()
        if heard.is_set():
            answers.came(loop.time())
            until = loop.time() + OTHERS_S
            while (now := loop.time()) < until:
                kind, system = onboard.autopilot.kind, onboard.autopilot.system_id or 1
                for frame in answers.due(now, autopilot_kind=kind, vehicle_system_id=system):
                    port.send(frame)
                await asyncio.sleep(0.1)
    finally:
        for task in (running, waiting, greeting):
            if task is not None:
                task.cancel()
                with contextlib.suppress(asyncio.CancelledError, Unusable):
                    await task
    view = onboard.autopilot
    held = "; it is watched only: the agent does not hold it" if view.watched_only else ""
    beside = "".join(f"; another autopilot, system {one}, is on this line" for one in view.other_systems)
    is_deaf = may_answer(view.kind) and not answers.hears(loop.time())
    asks = "it signs, and this agent has no key for it" if view.signing is Signing.NO_KEY else "is the way to it open?"
    deaf = f"; it has not answered: {asks}" if is_deaf else ""
    said = f"the autopilot is heard: system {view.system_id}, kind {view.kind}{deaf}{held}{beside}"
    return said if view.heard else None


def not_heard(port: SignedPort) -> str:
    """Returns why nothing was heard of the autopilot."""
    if port.line.state(asyncio.get_running_loop().time()) is Signing.WRONG_KEY:
        return f"what comes on {port.name} is not signed with this drone's key (docs/agent.md, Signing)"
    return f"no heartbeat on {port.name} within {LISTEN_S:.0f} s"


async def _greet(port: AutopilotPort, onboard: Onboard) -> None:
    """Sends heartbeats to an autopilot that waits for the first packet, and requests nothing else."""
    loop = asyncio.get_running_loop()
    while not onboard.autopilot.heard:
        onboard.tick(loop.time())
        for frame in onboard.frames_to_autopilot():
            port.send(frame)
        await asyncio.sleep(0.2)


def _say(good: bool, text: str) -> bool:
    print(f"{'ok ' if good else '!! '} {text}", flush=True)
    return good
