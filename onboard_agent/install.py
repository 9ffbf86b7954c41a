"""`tower-agent install` and `uninstall`: settings, key, service. Both may be repeated.

The user of the service is made by systemd at each start (DynamicUser); its groups must exist.
"""

from __future__ import annotations

import os
import shutil
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, NoReturn

from onboard_agent.autopilot_port.schemes import make_port
from onboard_agent.installation import DEVICES, the_autopilot_on_usb
from onboard_agent.link.enrolment import check_can_keep, enrol
from onboard_agent.link.identity_file import write_private
from onboard_agent.link.tower_url import parse_tower_url
from onboard_agent.service import UNIT, UNITS, Service, is_packaged, require_reachable, unit_text, used_paths
from onboard_agent.settings import DEFAULT_FILE, KEYS, as_toml
from onboard_agent.sockets.uplinks import parse_uplinks
from onboard_agent.unusable import Unusable
from onboard_agent.update.release_keys import parse_release_keys
from onboard_agent.video.camera_setting import parse_camera

TOKEN: Final = Path("/etc/tower-agent/token")


def install(options: Mapping[str, Any], devices: Path = DEVICES) -> bool:
    """Installs below `root`; what is there and not named stays. Returns whether the service is as asked for. Raises
    Unusable, before the one-time token is spent."""
    root, is_real = _root(options, "install")
    program, service = _program(), Service(say=_say)
    values = _values(root, options, devices)
    token = _below(root, TOKEN)
    folder = _below(root, DEFAULT_FILE).parent
    if is_real and service.is_there:
        require_reachable(used_paths(program))
    try:
        folder.mkdir(mode=0o755, parents=True, exist_ok=True)
        folder.chmod(0o755)  # an older version hid it; its secret is the token alone, which stays private
        _write(_below(root, DEFAULT_FILE), as_toml(values))
        _say(f"settings: {_below(root, DEFAULT_FILE)}")
        _enrol(values, token, options["enrol"])
        _say(f"service: {_write_unit(root, program)}; systemd makes its user at each start")
    except OSError as error:
        raise Unusable(f"{error.filename} cannot be written: {error.strerror}") from None
    if not is_real:
        return True
    if not service.is_there:
        _say("there is no systemd here: start `tower-agent run` by whatever starts services")
        return True
    if options["no_start"] or not token.exists():
        return service.enable()
    return service.enable() and service.start()


def uninstall(options: Mapping[str, Any]) -> bool:
    """Removes what `install` made: service, settings, key. Raises Unusable while the drone is armed."""
    root, is_real = _root(options, "uninstall")
    service = Service(say=_say)
    has_systemd = is_real and service.is_there
    if has_systemd and not service.remove():
        return False
    file = _below(root, DEFAULT_FILE)
    for path in (_below(root, UNITS) / UNIT, file, _below(root, TOKEN)):
        if path.exists():
            path.unlink()
            _say(f"removed: {path}")
    if file.parent.is_dir() and not list(file.parent.iterdir()):
        file.parent.rmdir()
    _say("the recordings of flights stay in /var/lib/tower-agent; the tower knows the drone until an admin deletes it")
    return not has_systemd or service.reload()


def _root(options: Mapping[str, Any], verb: str) -> tuple[Path, bool]:
    """Returns the folder to work below, and whether it is this system. There it goes on as root."""
    root: Path = options["root"]
    is_real = root == Path("/")
    if is_real and os.geteuid() != 0:
        _again_as_root(verb)
    return root, is_real


def _again_as_root(verb: str) -> NoReturn:
    if shutil.which("sudo") is None:
        raise Unusable(f"{verb} writes to /etc and to systemd: run it as root")
    _say(f"{verb} needs root: sudo asks for your password")
    os.execvp("sudo", ["sudo", str(_program()), *sys.argv[1:]])  # noqa: S606, S607  # this program, once more


def _write_unit(root: Path, program: Path) -> Path | str:
    """Writes the unit, unless a package brought the same."""
    unit = _below(root, UNITS) / UNIT
    if is_packaged(program, root):
        unit.unlink(missing_ok=True)  # of an installation before the package
        return UNIT
    unit.parent.mkdir(parents=True, exist_ok=True)
    _write(unit, unit_text(program))
    return unit


def _values(root: Path, options: Mapping[str, Any], devices: Path) -> dict[str, Any]:
    """Returns the settings of before with the new ones over them, checked."""
    file = _below(root, DEFAULT_FILE)
    try:
        before = tomllib.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise Unusable(f"{file} is not TOML: {error}") from None
    values: dict[str, Any] = {key: options.get(key) or before.get(key) for key in KEYS}
    values["token"] = None  # systemd hands the key to the service (LoadCredential)
    values["state"] = None  # and gives it a folder (StateDirectory)
    if not values["tower"]:
        raise Unusable(f"tower is not set: give {KEYS['tower'].flag}")
    if not values["autopilot"]:
        values["autopilot"] = the_autopilot_on_usb(devices)
        _say(f"autopilot: {values['autopilot']}")
    parse_tower_url(values["tower"])
    make_port(values["autopilot"])
    parse_camera(values["camera"] or "")
    parse_uplinks(values["uplinks"] or ())
    parse_release_keys(values["release_keys"] or ())
    return values


def _enrol(values: Mapping[str, Any], token: Path, one_time_token: str | None) -> None:
    if one_time_token is None:
        _say(
            f"key: {token}" if token.exists() else f"key: none yet. Run again with --enrol TOKEN, which writes {token}"
        )
        return
    check_can_keep(token)
    _say(f"this is {enrol(parse_tower_url(values['tower']), one_time_token, token)} now; its key is in {token}")


def _program() -> Path:
    """Returns this program's own place, or that of its virtual environment."""
    called = Path(sys.argv[0]).resolve()
    return called if called.name == "tower-agent" else Path(sys.prefix) / "bin" / "tower-agent"


def _write(path: Path, text: str) -> None:
    write_private(path, text)
    path.chmod(0o644)


def _below(root: Path, path: Path) -> Path:
    return root / path.relative_to("/")


def _say(text: str) -> None:
    print(text, flush=True)
