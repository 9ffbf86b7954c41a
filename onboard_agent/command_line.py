"""The options of `tower-agent`, made from the table of settings."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from onboard_agent.settings import DEFAULT_FILE, FILE_VARIABLE, KEYS, Setting

_SETTINGS_OF: Final = {
    "run": tuple(KEYS),
    "check": ("tower", "token", "autopilot", "system_id", "camera", "state", "log_level"),
    "doctor": tuple(KEYS),
    "enrol": ("token", "autopilot", "camera", "log_level"),
    "install": ("tower", "autopilot", "camera", "uplinks", "release_keys", "log_level"),
    "uninstall": (),
    "signing": ("token", "state", "log_level"),
}
_BELOW_ROOT: Final = ("install", "uninstall")
_PURPOSES: Final = {
    "run": "Link an autopilot to the tower until stopped.",
    "check": "Test the key file, the tower, the key, the autopilot and the camera, and print which of them work.",
    "doctor": "Test key, disk, network, clock, data channel, autopilot and camera, and say what to do about each.",
    "enrol": "Make this drone's key, register its public half with a one-time token, and start or print how to start.",
    "install": "Write the settings, enrol this drone, install and start the service, and test it. Asks for sudo.",
    "uninstall": "Remove the service, the settings and the key. Asks for sudo.",
    "vision": "Say what target finding sees in a picture.",
    "signing": "Print whether the autopilot's frames are signed; show, take or forget the key.",
}


def command_line(version: str) -> argparse.ArgumentParser:
    """Returns the parser of `tower-agent`. Options that were not given are None."""
    parser = argparse.ArgumentParser(
        prog="tower-agent", description="The agent on a drone's companion computer.", allow_abbrev=False
    )
    parser.add_argument("--version", action="version", version=version, help="Print the version.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, purpose in _PURPOSES.items():
        command = commands.add_parser(name, help=purpose, description=purpose, allow_abbrev=False)
        if name == "enrol":
            command.add_argument("tower", metavar="URL", help="https://HOST[:PORT]")
            command.add_argument("one_time_token", metavar="TOKEN", help="As an admin's console shows it.")
        if name == "install":
            _add_install(command)
        if name in _BELOW_ROOT:
            command.add_argument("--root", type=Path, default=Path("/"), help="Work below this folder; start nothing.")
        if name == "signing":
            _add_signing(command)
        if name == "vision":
            _add_vision(command)
            continue  # it needs no tower, no drone and no file of settings
        _add_settings(command, (KEYS[key] for key in _SETTINGS_OF[name]))
        if name not in _BELOW_ROOT:
            command.add_argument(
                "--config", type=Path, help=f"File with settings. Default: {FILE_VARIABLE}, else {DEFAULT_FILE}."
            )
    return parser


def _add_settings(command: argparse.ArgumentParser, settings: Iterable[Setting]) -> None:
    for one in settings:
        variables = ", ".join(one.variables)
        command.add_argument(
            one.flag,
            dest=one.key,
            action="append" if one.many else "store",
            help=f"{one.help} [{variables}]".replace("%", "%%"),
        )


def _add_signing(command: argparse.ArgumentParser) -> None:
    which = command.add_mutually_exclusive_group()
    which.add_argument("--show", action="store_true", help="Print the key, for another ground station.")
    which.add_argument("--take", action="store_true", help="Read a key that the autopilot has from standard input.")
    which.add_argument("--forget", action="store_true", help="Remove the key here. The autopilot keeps its own.")


def _add_install(command: argparse.ArgumentParser) -> None:
    command.add_argument("--enrol", metavar="TOKEN", help="One-time token, as an admin's console shows it.")
    command.add_argument("--no-start", action="store_true", help="Install the service without starting it.")


def _add_vision(command: argparse.ArgumentParser) -> None:
    command.add_argument("act", choices=("try",), help="Say what is seen in a picture.")
    command.add_argument("file", type=Path, metavar="FILE", help="JPEG, PNG or another picture.")
    command.add_argument("--target", default="squares", help="As the controller's setting `target`. Default: squares.")
    command.add_argument("--alphabet", help="The characters that occur. Default: A-Z and 0-9.")
    command.add_argument("--fov", type=float, metavar="DEGREES", help="Of the camera, across: gives metres.")
    command.add_argument("--out", type=Path, metavar="FILE", help="Write the picture with what was seen.")
    command.add_argument("--json", action="store_true", help="Print JSON.")
