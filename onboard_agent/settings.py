"""The agent's settings: one table for the command line, the environment, and the file `agent.toml`.

An option on the command line counts more than a variable, a variable more than the file, the file more than the
default. `deploy/agent.toml` and docs/agent.md describe every key; tests compare them with this table.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from onboard_agent.autopilot_port.schemes import help_text as autopilot_help
from onboard_agent.payload.servo import FORM as SERVO_FORM
from onboard_agent.unusable import Unusable
from onboard_agent.video.camera_setting import NO_CAMERA
from onboard_agent.video.sources.schemes import help_text as camera_help

DEFAULT_FILE: Final = Path("/etc/tower-agent/agent.toml")
FILE_VARIABLE: Final = "TOWER_AGENT_CONFIG"


@dataclass(frozen=True)
class Setting:
    """One setting. `variables`: the first that is set counts. `example`: what the example file shows."""

    key: str
    variables: tuple[str, ...]
    help: str
    example: str | list[str]
    default: str | None = None
    required: bool = False
    option: str = ""
    many: bool = False
    """A list in the file, several options on the command line, commas in the variable."""

    @property
    def flag(self) -> str:
        return f"--{self.option or self.key.replace('_', '-')}"


SETTINGS: Final = (
    Setting(
        "tower",
        ("TOWER_AGENT_TOWER",),
        "The tower's address: https://HOST[:PORT]; http:// for a tower on this machine only.",
        "https://tower.example.org",
        required=True,
    ),
    Setting(
        "token",
        ("TOWER_AGENT_TOKEN",),
        "File with the drone's key, or with the one-time token for its enrolment.",
        "/etc/tower-agent/token",
        required=True,
    ),
    Setting(
        "autopilot",
        ("TOWER_AGENT_AUTOPILOT",),
        f"The autopilot. {autopilot_help()}.",
        "serial:/dev/serial0:921600",
        required=True,
    ),
    Setting(
        "system_id",
        ("TOWER_AGENT_SYSTEM_ID",),
        "The MAVLink system of this drone, 1 to 255, where several share the line. Not set: the first that is heard.",
        "2",
        option="system-id",
    ),
    Setting(
        "also",
        ("TOWER_AGENT_ALSO",),
        "Other drones on the same line, each SYSTEM=FILE: its MAVLink system, and its key or one-time token.",
        ["2=/etc/tower-agent/token-2"],
        many=True,
    ),
    Setting(
        "camera",
        ("TOWER_AGENT_CAMERA",),
        f"The camera. {NO_CAMERA}: no video; {camera_help()}.",
        NO_CAMERA,
        default=NO_CAMERA,
    ),
    Setting(
        "sensor",
        ("TOWER_AGENT_SENSOR",),
        "A sensor that sends lines of JSON: serial:DEVICE[:BAUD], tcp:HOST:PORT or tcpin:HOST:PORT.",
        "serial:/dev/ttyUSB1:115200",
    ),
    Setting(
        "servos",
        ("TOWER_AGENT_SERVOS",),
        f"Servos on PWM pins of this computer, each {SERVO_FORM}, for DO_SET_SERVO with this number.",
        ["15=pwmchip0/0"],
        option="servo",
        many=True,
    ),
    Setting(
        "uplinks",
        ("TOWER_AGENT_UPLINKS",),
        "Ways out, by the name of an interface or a local address. Several: each datagram goes by all of them.",
        ["wlan0", "wwan0"],
        option="uplink",
        many=True,
    ),
    Setting(
        "state",
        ("TOWER_AGENT_STATE", "STATE_DIRECTORY"),
        "Folder for what must outlast the agent. Not set: what systemd gives, else ~/.local/state/tower-agent.",
        "/var/lib/tower-agent",
    ),
    Setting(
        "black_box",
        ("TOWER_AGENT_BLACK_BOX",),
        "Room for the recordings of flights in the state folder, in MB; the oldest make room. 0: none are made.",
        "1000",
        default="1000",
    ),
    Setting(
        "black_box_hz",
        ("TOWER_AGENT_BLACK_BOX_HZ",),
        "Attitude, sticks and outputs in those recordings, times a second, 10 to 100. 0: as often as the tower.",
        "50",
        default="0",
    ),
    Setting(
        "release_keys",
        ("TOWER_AGENT_RELEASE_KEYS",),
        "Public keys of who may sign releases of the agent. Without one the tower cannot update it.",
        ["GX+/RAlphM5+hUG6wWfcO5bIUIaqeSrHz4Sfq0bR8nA="],
        option="release-key",
        many=True,
    ),
    Setting(
        "controllers",
        ("TOWER_AGENT_CONTROLLERS",),
        "Controllers on board that the tower may start, each NAME=/FILE.py:CLASS.",
        ["survey=/opt/controllers/survey.py:Survey"],
        option="controller",
        many=True,
    ),
    Setting(
        "landing_pad",
        ("TOWER_AGENT_LANDING_PAD",),
        "Markers of the pad for precision landing: FAMILY:NUMBER=SIDE[@RIGHT,UP][;...], in metres.",
        "aruco-4x4-50:0=1.0@0,0.85;1=0.16",
        option="landing-pad",
    ),
    Setting(
        "landing_camera",
        ("TOWER_AGENT_LANDING_CAMERA",),
        "The camera that looks for the pad, as `camera`; behind # its view: tilt, fov in degrees, forward in metres.",
        "v4l2:/dev/video1#tilt=90&fov=75",
        option="landing-camera",
    ),
    Setting(
        "controller_cameras",
        ("TOWER_AGENT_CONTROLLER_CAMERAS",),
        "Cameras for controllers: NAME[,kind=...][,tilt=DEG][,fov=DEG][,up=M] and where, as camera; or video.",
        ["down,tilt=90,fov=75 video"],
        option="controller-camera",
        many=True,
    ),
    Setting(
        "payload_release",
        ("TOWER_AGENT_PAYLOAD_RELEASE",),
        "How a controller lets the payload go: gripper:NUMBER or servo:OUTPUT=MICROSECONDS.",
        "servo:9=1900",
        default="gripper:1",
    ),
    Setting(
        "log_level",
        ("TOWER_AGENT_LOG_LEVEL",),
        "debug, info, warning or error.",
        "info",
        default="info",
    ),
)
KEYS: Final = {one.key: one for one in SETTINGS}
_PREFIX: Final = "TOWER_AGENT_"
_OF_OTHERS: Final = frozenset(
    {"TOWER_AGENT_RELEASE", "TOWER_AGENT_TRIAL", "TOWER_AGENT_INSTALLED", "TOWER_AGENT_BASE_PATH"}
    | {"TOWER_AGENT_LAUNCHER", "TOWER_AGENT_RELEASES", "TOWER_AGENT_FRAMES_PER_S", "TOWER_AGENT_FRAMES_BURST"}
)
"""Of the agent's own launcher (`update/launch.py`), and of a tower on the same machine."""


def read_settings(
    options: Mapping[str, Any], environment: Mapping[str, str], file: Path | None = None, *, complete: bool = True
) -> dict[str, Any]:
    """Returns each setting's value by its key: text, a list, or None. `options`: what the command line said; `file`:
    the file it named. Raises Unusable naming the file and the key, a variable that is no setting, or a required setting
    that nobody gave if the settings must be `complete`."""
    _refuse_unknown(environment)
    from_file = _read_file(file, environment)
    found: dict[str, Any] = {}
    for one in SETTINGS:
        said = options.get(one.key)
        in_environment = next((text for name in one.variables if (text := environment.get(name, "").strip())), None)
        value = said or in_environment or from_file.get(one.key) or one.default
        found[one.key] = [value] if one.many and isinstance(value, str) else value
    missing = [one for one in SETTINGS if one.required and one.key in options and not found[one.key]]
    if missing and complete:
        ways = "; ".join(f"{one.key} is not set: give {one.flag}, {one.variables[0]}" for one in missing)
        raise Unusable(f"{ways}, or {'each' if len(missing) > 1 else missing[0].key} in {DEFAULT_FILE}")
    return found


def _refuse_unknown(environment: Mapping[str, str]) -> None:
    known = {name for one in SETTINGS for name in one.variables if name.startswith(_PREFIX)} | {FILE_VARIABLE}
    for name in sorted(environment.keys() - known - _OF_OTHERS):
        if name.startswith(_PREFIX) and environment[name].strip():
            from difflib import get_close_matches  # not in the memory of every agent

            near = get_close_matches(name.removeprefix(_PREFIX), [one.removeprefix(_PREFIX) for one in known], 1)
            meant = f": did you mean {_PREFIX}{near[0]}?" if near else "; docs/agent.md has all of them"
            raise Unusable(f"{name} is not a setting of the agent{meant}")


def parse_system_id(text: str | None) -> int | None:
    """Returns the MAVLink system id; None if there is none. Raises Unusable."""
    if text is None:
        return None
    if not (text.isascii() and text.isdigit() and 1 <= int(text) <= 255):
        raise Unusable(f"system_id {text!r}: a MAVLink system id is a number from 1 to 255")
    return int(text)


def _read_file(file: Path | None, environment: Mapping[str, str]) -> dict[str, Any]:
    named = file or (Path(text) if (text := environment.get(FILE_VARIABLE, "").strip()) else None)
    try:
        content = tomllib.loads((named or DEFAULT_FILE).read_text(encoding="utf-8"))
    except OSError as error:
        if named is None:
            return {}  # the default file need not exist, and an installation of before may hide its folder
        raise Unusable(f"{named} cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise Unusable(f"{named or DEFAULT_FILE} is not TOML: {error}") from None
    for key, value in content.items():
        _check(named or DEFAULT_FILE, key, value)
    return content


def _check(file: Path, key: str, value: object) -> None:
    setting = KEYS.get(key)
    if setting is None:
        from difflib import get_close_matches  # not in the memory of every agent

        near = get_close_matches(key, KEYS, 1)
        meant = f" (did you mean {near[0]}?)" if near else ""
        raise Unusable(f"{file}: there is no setting {key!r}{meant}; known: {', '.join(KEYS)}")
    if setting.many and not (isinstance(value, list) and all(isinstance(one, str) for one in value)):
        raise Unusable(f'{file}: {key} must be a list of texts, as in {key} = ["wlan0"]')
    if not setting.many and not isinstance(value, str):
        raise Unusable(f'{file}: {key} must be a text in quotes, as in {key} = "{setting.example}"')


def as_toml(values: Mapping[str, Any]) -> str:
    """Returns the file with these values. Settings without one are shown as examples, commented out."""
    return "\n".join(_toml_lines(values)) + "\n"


def _toml_lines(values: Mapping[str, Any]) -> Iterator[str]:
    yield "# Settings of tower-agent. Command line and TOWER_AGENT_... variables count more than this file."
    for one in SETTINGS:
        yield ""
        yield from _comment(one.help)
        value = values.get(one.key)
        # JSON's texts and lists of texts are TOML's.
        line = f"{one.key} = {json.dumps(one.example if value is None else value, ensure_ascii=False)}"
        yield line if value is not None else f"# {line}"


def _comment(text: str, width: int = 118) -> Sequence[str]:
    import textwrap

    return textwrap.wrap(text, width, initial_indent="# ", subsequent_indent="# ", break_on_hyphens=False)
