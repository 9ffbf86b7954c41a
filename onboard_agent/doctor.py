"""`tower-agent doctor`: tests each part on its own, and says what to do about each that does not work.

It makes a link of its own for some seconds, to see whether datagrams pass; but only while no agent of this drone runs
here, because the tower keeps one link for each drone.
"""

from __future__ import annotations

import asyncio
import contextlib
import shutil
import socket
import ssl
import time
import urllib.error
import urllib.request
from collections.abc import AsyncIterator
from dataclasses import dataclass
from email.utils import parsedate_to_datetime
from pathlib import Path
from typing import Any, Final

from onboard_agent.autopilot_port.port import AutopilotPort
from onboard_agent.autopilot_port.schemes import make_port
from onboard_agent.check import listen, not_heard
from onboard_agent.installation import camera_trouble, port_trouble, video_remedy
from onboard_agent.link.identity import Identity
from onboard_agent.link.identity_file import enrolment_token, read_identity
from onboard_agent.link.tower_url import TowerUrl, parse_tower_url
from onboard_agent.settings import DEFAULT_FILE, KEYS, parse_system_id
from onboard_agent.signing.signed_port import with_signing
from onboard_agent.sockets.control_channel import NoLink, try_sign_in
from onboard_agent.sockets.tower_link import TowerLink
from onboard_agent.sockets.uplinks import parse_uplinks
from onboard_agent.state_directory import claim, state_directory
from onboard_agent.unusable import Unusable
from onboard_agent.video.camera_setting import NO_CAMERA, parse_camera
from onboard_agent.video.trial import try_camera
from wire.content import Frames
from wire.control_messages import ToAgent, Welcome

KEY_FILE: Final = "/etc/tower-agent/token"
MIN_FREE_MB: Final = 200
"""A flight log in upload, parameters and plans need less; a full card breaks more than the agent."""
MAX_CLOCK_OFF_S: Final = 30.0
ANSWER_WITHIN_S: Final = 10.0
UDP_WITHIN_S: Final = 8.0
"""Within 3 s without an answer over UDP a link goes over to the control channel."""


@dataclass(frozen=True)
class Finding:
    """What was found of one part. `good`: None if it could not be tested. `remedy`: what to do."""

    part: str
    good: bool | None
    found: str
    remedy: str = ""


async def examine(settings: dict[str, Any]) -> bool:
    """Prints what it finds of each part. Returns whether no part is broken. A setting that is missing leaves out what
    needs it. Raises Unusable for one that cannot be read."""
    url = parse_tower_url(settings["tower"]) if settings["tower"] else None
    port = make_port(settings["autopilot"]) if settings["autopilot"] else None
    camera, uplinks = parse_camera(settings["camera"]), parse_uplinks(settings["uplinks"] or ())
    settings = {**settings, "token": settings["token"] or KEY_FILE}
    good = _say(_set(settings))
    async for finding in _findings(settings, url, uplinks):
        good = _say(finding) and good
    good = _say(await _autopilot(port, settings)) and good
    return _say(await _camera(camera, url)) and good


def _set(settings: dict[str, Any]) -> Finding:
    missing = [KEYS[key] for key in ("tower", "autopilot") if not settings[key]]
    if not missing:
        return Finding("settings", True, "tower and autopilot are set")
    remedy = f"give {' and '.join(f'{one.flag} {one.example}' for one in missing)}, or write them to {DEFAULT_FILE}"
    return Finding("settings", False, f"not set: {', '.join(one.key for one in missing)}", remedy)


def _say(finding: Finding) -> bool:
    mark = {True: "ok", False: "!!", None: "--"}[finding.good]
    print(f"{mark} {finding.part:<9} {finding.found}", flush=True)
    if finding.remedy and finding.good is not True:
        print(f"   {'':<9} -> {finding.remedy}", flush=True)
    return finding.good is not False


async def _findings(settings: dict[str, Any], url: TowerUrl | None, uplinks: tuple[str, ...]) -> AsyncIterator[Finding]:
    state = None if settings["state"] is None else Path(settings["state"])
    identity, key = _key(Path(settings["token"]), state)
    yield key
    folder = state_directory(state, identity.drone_id) if identity else state or Path.home()
    yield disk(folder)
    if url is None:
        for part in ("network", "clock", "sign-in", "UDP"):
            yield Finding(part, None, "not tested: no tower is set")
        return
    network, date = await asyncio.to_thread(reach, url)
    yield network
    yield clock(date, time.time())
    if identity is None or not network.good:
        yield Finding("sign-in", None, "not tested, see above")
        yield Finding("UDP", None, "not tested, see above")
        return
    signed_in = await _sign_in(url, identity)
    yield signed_in
    yield (
        await _udp(url, identity, uplinks, folder) if signed_in.good else Finding("UDP", None, "not tested, see above")
    )


def _key(token: Path, state: Path | None) -> tuple[Identity | None, Finding]:
    enrol = "paste here the command that the console shows (Admin, Drones, Enrol)"
    try:
        if enrolment_token(token) is not None:
            return None, Finding("key", False, f"{token} holds a one-time token: this drone is not enrolled yet", enrol)
        identity = read_identity(token, lambda drone_id: state_directory(state, drone_id))
    except Unusable as error:
        return None, Finding("key", False, str(error), enrol)
    return identity, Finding("key", True, f"that of drone {identity.drone_id}, in {token}")


def disk(folder: Path) -> Finding:
    """Tests whether the state folder can be written, and how much room there is."""
    there = next(one for one in (folder, *folder.parents) if one.exists())
    remedy = f"make room on that disk (at least {MIN_FREE_MB} MB), or choose another folder with --state"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        probe = folder / ".doctor"
        probe.write_bytes(b"tower-agent doctor")
        probe.unlink()
        free_mb = shutil.disk_usage(folder).free // 1_000_000
    except OSError as error:
        return Finding("disk", False, f"{folder} cannot be written: {error.strerror} (at {there})", remedy)
    return Finding("disk", free_mb >= MIN_FREE_MB, f"{free_mb} MB free for {folder}", remedy)


def reach(url: TowerUrl) -> tuple[Finding, str]:
    """Asks the tower for its health. Returns what was found, and the Date that the tower answered with."""
    try:
        socket.getaddrinfo(url.host, url.port, type=socket.SOCK_STREAM)
    except OSError as error:
        remedy = "is there a network (`ip addr`, `ip route`)? Is the name right (`getent hosts NAME`)?"
        return Finding("network", False, f"the name {url.host} is not found: {error.strerror}", remedy), ""
    proxies = urllib.request.ProxyHandler(None if url.secure else {})
    try:
        with urllib.request.build_opener(proxies).open(f"{url}/api/v1/health", timeout=ANSWER_WITHIN_S) as answer:
            return Finding("network", True, f"{url} answers"), answer.headers.get("Date", "")
    except urllib.error.HTTPError as error:
        remedy = "is this the tower's address? A proxy or a captive portal may answer in its place"
        with error:
            return Finding("network", False, f"{url} answers with status {error.code}", remedy), ""
    except (urllib.error.URLError, OSError) as error:
        reason = error.reason if isinstance(error, urllib.error.URLError) else error
        return Finding("network", False, f"{url} does not answer: {reason}", _network_remedy(reason)), ""


def _network_remedy(reason: object) -> str:
    if isinstance(reason, ssl.SSLCertVerificationError):
        return "is the clock right? For a certificate of your own authority set SSL_CERT_FILE"
    if isinstance(reason, ConnectionRefusedError):
        return "nothing listens there: is the tower running, and is the port right?"
    return "is there a route (`ip route`)? Does a firewall hold back TCP to this port?"


def clock(date: str, now_s: float) -> Finding:
    """Compares this computer's clock with the tower's."""
    try:
        off_s = now_s - parsedate_to_datetime(date).timestamp()
    except (ValueError, TypeError):
        return Finding("clock", None, "not tested: the tower told no time")
    found = f"{abs(off_s):.0f} s {'ahead of' if off_s > 0 else 'behind'} the tower's"
    remedy = "`timedatectl set-ntp true`, and wait until `timedatectl` says that it is synchronised"
    return Finding("clock", abs(off_s) <= MAX_CLOCK_OFF_S, found, remedy)


async def _sign_in(url: TowerUrl, identity: Identity) -> Finding:
    try:
        return Finding("sign-in", True, f"{url} accepts {await try_sign_in(url, identity)}")
    except NoLink as error:
        return Finding("sign-in", False, str(error), "is the key of another tower, or revoked? Enrol the drone again")


class _Listener:
    """The user of the trial link: it carries out nothing."""

    def __init__(self) -> None:
        self.heard = asyncio.Event()

    def tower_heard(self) -> None:
        self.heard.set()

    def link_up(self, welcome: Welcome) -> None: ...
    def link_down(self) -> None: ...
    def link_resumed(self) -> None: ...
    def message(self, message: ToAgent) -> None: ...
    def frames(self, frames: Frames) -> None: ...


async def _udp(url: TowerUrl, identity: Identity, uplinks: tuple[str, ...], folder: Path) -> Finding:
    if claim(folder) is not None:
        remedy = "`systemctl stop tower-agent`, on the ground, and run this again"
        return Finding("UDP", None, "not tested: the agent of this drone is running", remedy)
    user = _Listener()
    link = TowerLink(url, identity, user, uplinks)
    running = asyncio.create_task(link.run())
    try:
        async with asyncio.timeout(UDP_WITHIN_S):
            await user.heard.wait()
        over_udp, rtt_s = link.over_udp, link.rtt_s
    except TimeoutError:
        return Finding("UDP", False, f"no datagram came back within {UDP_WITHIN_S:.0f} s", _UDP_REMEDY)
    finally:
        running.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await running
    passed = "datagrams pass" if rtt_s is None else f"datagrams pass, {1000 * rtt_s:.0f} ms there and back"
    found = passed if over_udp else "blocked: everything goes over the control channel (TCP)"
    return Finding("UDP", over_udp, found, _UDP_REMEDY)


_UDP_REMEDY: Final = "open UDP port 14650 (TOWER_UDP_PORT) to the tower. The drone flies without, but feels each loss"


async def _autopilot(port: AutopilotPort | None, settings: dict[str, Any]) -> Finding:
    if port is None:
        return Finding("autopilot", None, "not tested: none is set")
    if (trouble := port_trouble(settings["autopilot"])) is not None:
        return Finding("autopilot", False, *trouble)
    system_id = parse_system_id(settings["system_id"])
    state = None if settings["state"] is None else Path(settings["state"])
    identity, _ = _key(Path(settings["token"]), state)
    folder = state_directory(state, identity.drone_id) if identity else state or Path.home()
    signed, _ = with_signing(port, folder, system_id)
    remedy = "is it powered? Wiring TX to RX; its port set to MAVLink 2 at the same baud; no other program on it"
    try:
        heard = await listen(signed, system_id)
    except Unusable as error:
        return Finding(
            "autopilot", False, str(error), "is the agent running? `systemctl stop tower-agent`, on the ground"
        )
    return Finding("autopilot", heard is not None, heard or not_heard(signed), remedy)


async def _camera(camera: str, url: TowerUrl | None) -> Finding:
    from importlib.util import find_spec

    if camera == NO_CAMERA:
        return Finding("camera", None, "none is set")
    if find_spec("av") is None:
        return Finding("camera", False, "the video libraries are missing", video_remedy())
    if (trouble := camera_trouble(camera)) is not None:
        return Finding("camera", False, *trouble)
    if url is None:
        return Finding("camera", None, "not tested: no tower is set")
    good, words = await try_camera(camera, url)
    remedy = "is it plugged in, and free? `v4l2-ctl --list-devices`, `rpicam-hello`, or open its address in a player"
    return Finding("camera", good, words, remedy)
