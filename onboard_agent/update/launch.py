"""Starts the release that was installed last, and takes it back when it does not link with the tower in time.

`tower-agent run` comes here first. Without an update it returns at once, and the installed agent runs. Otherwise Python
starts again with the release's packages before its own. While a release is on trial this process stays above it, passes
on what it tells systemd, and ends it after TRIAL_S without a link.
"""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, NoReturn

from onboard_agent import VERSION
from onboard_agent.systemd import LINKED
from onboard_agent.update.releases import Releases, Trial

TRIAL_S: Final = 60.0
RELEASE: Final = "TOWER_AGENT_RELEASE"
"""Of a process that runs a release: its version."""
TRANSACTION: Final = "TOWER_AGENT_TRIAL"
"""Of a process on trial: the tower's transaction that waits for it."""
START_AGAIN: Final = 75
"""Exit code of an agent below a launcher that wants to be started again."""
INSTALLED: Final = "TOWER_AGENT_INSTALLED"
"""Of a process that runs a release: the version of the installed agent."""
_BASE_PATH: Final = "TOWER_AGENT_BASE_PATH"
_ABOVE: Final = "TOWER_AGENT_LAUNCHER"
_START: Final = "import sys; sys.argv[0] = 'tower-agent'; from onboard_agent.cli import main; main()"
_END_WITHIN_S: Final = 5.0
_log = logging.getLogger(__name__)


def launch(releases: Releases) -> None:
    """Returns if this process is to be the agent. Otherwise it never does."""
    if RELEASE in os.environ:
        return
    while True:
        trial = releases.trial
        if trial is None:
            break
        if trial.is_running:
            _roll_back(releases, trial, f"The trial of {trial.version} was interrupted before it linked.")
            continue
        if releases.current != trial.version:  # a power cut between trial and switch
            _roll_back(releases, trial, f"The switch to {trial.version} was interrupted.")
            continue
        releases.trial_runs(trial)
        why = _Trial(releases, trial).run()
        if why is not None:
            _roll_back(releases, trial, why)
    version = releases.current
    if version:
        _log.info("the release %s runs; the installed agent is %s", version, VERSION)
        _replace(_environment(releases.path(version), version))


def start_again() -> NoReturn:
    """Ends the agent; what `launch` finds then runs."""
    if _ABOVE in os.environ:
        sys.exit(START_AGAIN)
    environment = dict(os.environ)
    base = environment.pop(_BASE_PATH, None)
    for name in (RELEASE, INSTALLED, TRANSACTION):
        environment.pop(name, None)
    if base is not None:
        environment["PYTHONPATH"] = base
        if not base:
            del environment["PYTHONPATH"]
    _replace(environment)


def installed_version() -> str:
    """What a person installed on this drone."""
    return os.environ.get(INSTALLED, VERSION)


def _roll_back(releases: Releases, trial: Trial, why: str) -> None:
    _log.error("%s", why)
    releases.roll_back(trial, why, installed=VERSION)


def _environment(path: Path, version: str) -> dict[str, str]:
    base = os.environ.get("PYTHONPATH", "")
    before = [str(path), base] if base else [str(path)]
    own = {"PYTHONPATH": os.pathsep.join(before), _BASE_PATH: base, RELEASE: version, INSTALLED: VERSION}
    return {**os.environ, **own}


def _command() -> list[str]:
    # -P: the working folder is no place for modules.
    return [sys.executable, "-P", "-c", _START, *sys.argv[1:]]


def _replace(environment: Mapping[str, str]) -> NoReturn:
    sys.stdout.flush()
    sys.stderr.flush()
    os.execve(sys.executable, _command(), dict(environment))  # noqa: S606  # ourselves


class _Trial:
    """One run of a release below this process."""

    def __init__(self, releases: Releases, trial: Trial) -> None:
        self._releases = releases
        self._trial = trial
        self._linked = False
        self._systemd = os.environ.get("NOTIFY_SOCKET", "")
        self._ending = False

    def run(self) -> str | None:
        """Returns why the release must go; None: start again without a word. Ends with the agent once it has linked."""
        with (
            tempfile.TemporaryDirectory(prefix="tower-agent-") as folder,
            socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as heard,
        ):
            address = f"{folder}/notify"
            heard.bind(address)
            heard.settimeout(0.2)
            environment = _environment(self._releases.path(self._trial.version), self._trial.version)
            environment |= {"NOTIFY_SOCKET": address, TRANSACTION: str(self._trial.transaction), _ABOVE: "1"}
            child = subprocess.Popen(_command(), env=environment)  # noqa: S603  # ourselves
            for number in (signal.SIGTERM, signal.SIGINT):
                signal.signal(number, lambda number, frame: self._end(child, number))
            try:
                return self._watch(child, heard)
            finally:
                if child.poll() is None:
                    child.kill()
                    child.wait()
                for number in (signal.SIGTERM, signal.SIGINT):
                    signal.signal(number, signal.SIG_DFL)

    def _watch(self, child: subprocess.Popen[bytes], heard: socket.socket) -> str | None:
        version = self._trial.version
        until = time.monotonic() + TRIAL_S
        while True:
            with contextlib.suppress(TimeoutError):
                self._passed_on(heard.recv(4096))
            code = child.poll()
            if code is not None:
                if self._ending:
                    sys.exit(0 if code >= 0 else 128 - code)
                if not self._linked:
                    return f"The agent {version} ended with exit status {code} before it linked with the tower."
                if code == START_AGAIN:
                    return None
                sys.exit(code if code >= 0 else 128 - code)
            if not self._linked and time.monotonic() > until:
                return f"The agent {version} did not link with the tower within {TRIAL_S:.0f} s."

    def _passed_on(self, text: bytes) -> None:
        if LINKED.encode() in text.split(b"\n") and not self._linked:
            self._linked = True
            self._releases.accept()
            _log.info("the release %s has linked with the tower: it stays", self._trial.version)
        if self._systemd:
            address = "\0" + self._systemd[1:] if self._systemd.startswith("@") else self._systemd
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as to:
                to.setblocking(False)
                try:
                    to.sendto(text, address)
                except OSError:
                    _log.debug("systemd does not listen")

    def _end(self, child: subprocess.Popen[bytes], number: int) -> None:
        self._ending = True
        child.send_signal(number)


def transaction_on_trial(environment: Mapping[str, str]) -> int | None:
    """The tower's transaction that waits for this process; None: it is not on trial."""
    text: Any = environment.get(TRANSACTION, "")
    return int(text) if text.isdecimal() else None
