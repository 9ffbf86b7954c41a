"""The agent as a service of systemd: its unit, its start, whether its drone is armed, and its removal."""

from __future__ import annotations

import grp
import shutil
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Final

from onboard_agent.systemd import ARMED
from onboard_agent.unusable import Unusable

UNIT: Final = "tower-agent.service"
UNITS: Final = Path("/etc/systemd/system")
PACKAGED_UNITS: Final = Path("/usr/lib/systemd/system")
GROUPS: Final = ("dialout", "video")
START_PATIENCE_S: Final = 25.0
_BESIDE: Final = Path(__file__).with_name(UNIT)
_CHECKOUT: Final = Path(__file__).resolve().parents[1] / "deploy" / UNIT
_PRIVATE: Final = (Path("/home"), Path("/root"), Path("/run/user"))
"""Folders that the unit's ProtectHome hides."""


def unit_text(program: Path, used: Iterable[Path] | None = None) -> str:
    """The unit, for the agent at this place. `used`: where its files are; None: those of this process."""
    text = (_BESIDE if _BESIDE.exists() else _CHECKOUT).read_text(encoding="utf-8")
    text = text.replace("ExecStart=/opt/tower-agent/bin/tower-agent ", f"ExecStart={program} ")
    if any(path.is_relative_to(home) for path in used or used_paths(program) for home in _PRIVATE):
        text = text.replace("ProtectHome=yes", "ProtectHome=read-only")
    return text


def used_paths(program: Path) -> list[Path]:
    """Where the files of this agent are: its program, its packages and its Python."""
    return [program, Path(__file__).resolve(), Path(sys.base_prefix), Path(sys.prefix)]


def require_reachable(paths: Iterable[Path]) -> None:
    """The service has a user of its own. Raises Unusable if that user cannot enter a folder above `paths`."""
    for path in paths:
        for folder in reversed((path.absolute(), *path.absolute().parents)):
            if folder.is_dir() and not folder.stat().st_mode & stat.S_IXOTH:
                raise Unusable(
                    f"the service's user may not enter {folder}, where the agent is installed: install it below /opt"
                    f" (docs/agent.md), or `chmod o+x {folder}`"
                )


class Service:
    """`systemctl`: the program."""

    def __init__(self, systemctl: str = "systemctl", say: Callable[[str], None] = print) -> None:
        self._systemctl = systemctl
        self._say = say

    @property
    def is_there(self) -> bool:
        return shutil.which(self._systemctl) is not None

    @property
    def status(self) -> str:
        """The line of the running service; empty: it does not run."""
        return self._answer("show", "--property=StatusText", "--value", UNIT)

    @property
    def armed(self) -> bool:
        return self.status.endswith(f", {ARMED}")

    def enable(self) -> bool:
        return _make_groups() and self._does("daemon-reload") and self._does("enable", UNIT)

    def start(self, *, wait_s: float = START_PATIENCE_S) -> bool:
        """Starts it, or restarts it with new settings. Returns whether tower and autopilot are there."""
        if self.armed:
            self._say("!! the drone is armed: the service goes on as it was. Repeat this when it is disarmed")
            return False
        if not self._does("restart", UNIT):
            return False
        until = time.monotonic() + wait_s
        while not self.status.startswith("tower linked, autopilot heard") and time.monotonic() < until:
            time.sleep(0.2)
        status = self.status
        is_well = status.startswith("tower linked, autopilot heard")
        self._say(f"{'started' if is_well else '!! started, but'}: {status or 'it does not run'}")
        if not is_well:
            self._say("-> `tower-agent doctor` says what to do; `journalctl -u tower-agent` says more")
        return is_well

    def remove(self) -> bool:
        """Stops it for good. Raises Unusable while the drone is armed."""
        if self.armed:
            raise Unusable("the drone is armed: disarm it first")
        known = self._answer("show", "--property=LoadState", "--value", UNIT)
        return known == "not-found" or self._does("disable", "--now", UNIT)

    def reload(self) -> bool:
        return self._does("daemon-reload")

    def _answer(self, *words: str) -> str:
        command = (self._systemctl, *words)
        done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603  # our own words alone
        return done.stdout.strip()

    def _does(self, *words: str) -> bool:
        return runs(self._systemctl, *words)


def runs(*command: str) -> bool:
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603  # our own words alone
    if done.returncode != 0:
        print(f"!! {' '.join(command)}: {(done.stderr or done.stdout).strip()}", file=sys.stderr)
    return done.returncode == 0


def is_packaged(program: Path, root: Path = Path("/")) -> bool:
    """Whether a package brought a unit that starts this program. Then upgrades of the package renew the unit."""
    packaged = root / PACKAGED_UNITS.relative_to("/") / UNIT
    return packaged.exists() and f"\nExecStart={program} " in packaged.read_text(encoding="utf-8")


def _make_groups() -> bool:
    """Makes the groups of the unit that this system lacks: systemd starts no unit with an unknown group."""
    return all(_exists(group) or runs("groupadd", "--system", group) for group in GROUPS)


def _exists(group: str) -> bool:
    try:
        grp.getgrnam(group)
    except KeyError:
        return False
    return True
