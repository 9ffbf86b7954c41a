"""`tower-agent install`: settings, key, service, start. It may be repeated: what is there and not named stays.

The user of the service is made by systemd at each start (DynamicUser); its groups must exist.
"""

from __future__ import annotations

import grp
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from onboard_agent.autopilot_port.schemes import make_port
from onboard_agent.link.enrolment import check_can_keep, enrol
from onboard_agent.link.identity_file import write_private
from onboard_agent.link.tower_url import parse_tower_url
from onboard_agent.settings import DEFAULT_FILE, KEYS, as_toml
from onboard_agent.sockets.uplinks import parse_uplinks
from onboard_agent.unusable import Unusable
from onboard_agent.update.release_keys import parse_release_keys
from onboard_agent.video.camera_setting import parse_camera

UNIT: Final = "tower-agent.service"
GROUPS: Final = ("dialout", "video")
TOKEN: Final = Path("/etc/tower-agent/token")
UNITS: Final = Path("/etc/systemd/system")
_PACKAGED: Final = Path(__file__).with_name(UNIT)
_CHECKOUT: Final = Path(__file__).resolve().parents[1] / "deploy" / UNIT


def install(options: Mapping[str, Any]) -> bool:
    """Installs below `root`. Returns whether the service is as asked for. Raises Unusable."""
    root: Path = options["root"]
    real = root == Path("/")
    if real and os.geteuid() != 0:
        raise Unusable("install writes to /etc and starts a service: run it as root (sudo)")
    values = _values(root, options)
    token = _below(root, TOKEN)
    folder = _below(root, DEFAULT_FILE).parent
    try:
        folder.mkdir(mode=0o755, parents=True, exist_ok=True)
        folder.chmod(0o755)  # an older version hid it; its secret is the token alone, which stays private
        _write(_below(root, DEFAULT_FILE), as_toml(values))
        _say(f"settings: {_below(root, DEFAULT_FILE)}")
        _enrol(values, token, options["enrol"])
        unit = _below(root, UNITS) / UNIT
        unit.parent.mkdir(parents=True, exist_ok=True)
        _write(unit, unit_text(_program()))
    except OSError as error:
        raise Unusable(f"{error.filename} cannot be written: {error.strerror}") from None
    _say(f"service: {unit}; systemd makes its user at each start")
    return not real or (_make_groups() and _start(token, start=not options["no_start"]))


def _values(root: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the settings of before with the new ones over them, checked."""
    file = _below(root, DEFAULT_FILE)
    try:
        before = tomllib.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise Unusable(f"{file} is not TOML: {error}") from None
    values: dict[str, Any] = {key: options.get(key) or before.get(key) for key in KEYS}
    values["token"] = None  # systemd hands the key to the service (LoadCredential)
    values["state"] = None  # and gives it a folder (StateDirectory)
    for key in ("tower", "autopilot"):
        if not values[key]:
            raise Unusable(f"{key} is not set: give {KEYS[key].flag}")
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


def unit_text(program: Path) -> str:
    """Returns the unit, for the agent at this place."""
    text = (_PACKAGED if _PACKAGED.exists() else _CHECKOUT).read_text(encoding="utf-8")
    return text.replace("ExecStart=/opt/tower-agent/bin/tower-agent ", f"ExecStart={program} ")


def _program() -> Path:
    """Returns this program's own place, or that of its virtual environment."""
    called = Path(sys.argv[0]).absolute()
    return called if called.name == "tower-agent" else Path(sys.prefix) / "bin" / "tower-agent"


def _make_groups() -> bool:
    """Makes the groups of the unit that this system lacks: systemd starts no unit with an unknown group."""
    return all(_exists(group) or _runs("groupadd", "--system", group) for group in GROUPS)


def _exists(group: str) -> bool:
    try:
        grp.getgrnam(group)
    except KeyError:
        return False
    return True


def _start(token: Path, *, start: bool) -> bool:
    if shutil.which("systemctl") is None:
        _say("there is no systemd here: start `tower-agent run` by whatever starts services")
        return True
    words = ("enable", "--now") if start and token.exists() else ("enable",)
    done = _runs("systemctl", "daemon-reload") and _runs("systemctl", *words, UNIT)
    if done and "--now" in words:
        done = _runs("systemctl", "restart", UNIT)  # if it ran before, it takes the new settings
        _say("started. `tower-agent doctor` tests every part; `systemctl status tower-agent` says how it is")
    return done


def _runs(*command: str) -> bool:
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603  # our own words alone
    if done.returncode != 0:
        print(f"!! {' '.join(command)}: {(done.stderr or done.stdout).strip()}", file=sys.stderr)
    return done.returncode == 0


def _write(path: Path, text: str) -> None:
    write_private(path, text)
    path.chmod(0o644)


def _below(root: Path, path: Path) -> Path:
    return root / path.relative_to("/")


def _say(text: str) -> None:
    print(text, flush=True)
