"""The folder of installed releases: which of them runs, which is on trial, and how the last trial ended. Disk only.

    releases/0.4.0/     what the package of 0.4.0 holds, ready to import
    releases/current    a link to the one that runs; without it the installed agent runs
    releases/trial      a release that has not linked with the tower yet
    releases/outcome    how its trial ended, until the tower knows

Each change is one rename, so that a power cut leaves the state before or the state after.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import zipfile
from pathlib import Path
from typing import Final, TypeVar

import msgspec

from wire.transactions import Outcome

MAX_UNPACKED_BYTES: Final = 400_000_000
MAX_FILES: Final = 20_000
_T = TypeVar("_T")


class Trial(msgspec.Struct, frozen=True):
    """A release that must prove itself. `before`: what ran until then; empty: the installed agent."""

    version: str
    before: str
    transaction: int
    is_running: bool = False


class TrialOutcome(msgspec.Struct, frozen=True):
    """How a trial ended: the result of the tower's transaction."""

    transaction: int
    outcome: Outcome
    words: str


class NotInstalled(Exception):
    """The message says why, as the end of a sentence about the package."""


class Releases:
    """`folder` is this agent's own. Methods raise OSError where the disk does."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._current = folder / "current"
        self._trial = folder / "trial"
        self._outcome = folder / "outcome"

    @property
    def current(self) -> str:
        """The version that runs; empty: the installed agent."""
        try:
            name = self._current.readlink().name
        except OSError:
            return ""
        return name if (self._folder / name / "onboard_agent").is_dir() else ""

    def path(self, version: str) -> Path:
        """Where this version's packages are."""
        return self._folder / version

    @property
    def incoming(self) -> Path:
        """Where a package is received."""
        self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        return self._folder / "incoming"

    @property
    def trial(self) -> Trial | None:
        return _read(self._trial, Trial)

    def install(self, version: str, package: Path) -> None:
        """Unpacks a package that was verified. Raises NotInstalled."""
        target, part = self.path(version), self._folder / f"{version}.part"
        shutil.rmtree(part, ignore_errors=True)
        try:
            _unpack(package, part)
        except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError):
            raise NotInstalled("cannot be unpacked") from None
        if not (part / "onboard_agent" / "cli.py").is_file():
            shutil.rmtree(part)
            raise NotInstalled("holds no agent")
        shutil.rmtree(target, ignore_errors=True)
        part.rename(target)
        _sync(self._folder)

    def begin_trial(self, version: str, transaction: int) -> None:
        """From the next start on this version runs, on trial."""
        before = self.current
        # First the trial, then the link: a power cut in between tries what runs already.
        self._write(self._trial, Trial(version, before, transaction))
        self._switch(version)
        self._remove_others(version, before)

    def trial_runs(self, trial: Trial) -> None:
        """A start that finds this has been interrupted."""
        self._write(self._trial, Trial(trial.version, trial.before, trial.transaction, is_running=True))

    def accept(self) -> None:
        """The release has linked: it stays."""
        self._trial.unlink(missing_ok=True)
        _sync(self._folder)

    def roll_back(self, trial: Trial, why: str, *, installed: str) -> None:
        """What ran before runs again at the next start. `installed`: the version of the installed agent."""
        words = f"{why} The drone is back at {trial.before or installed}."
        self._write(self._outcome, TrialOutcome(trial.transaction, Outcome.FAILED, words))
        self._switch(trial.before)
        self._trial.unlink(missing_ok=True)
        _sync(self._folder)
        if trial.version != trial.before:
            shutil.rmtree(self.path(trial.version), ignore_errors=True)

    def pop_outcome(self) -> TrialOutcome | None:
        """Returns how the last trial ended, once."""
        found = _read(self._outcome, TrialOutcome)
        with contextlib.suppress(OSError):
            self._outcome.unlink(missing_ok=True)
        return found

    def _switch(self, version: str) -> None:
        if not version:
            self._current.unlink(missing_ok=True)
        else:
            made = self._folder / "current.new"
            made.unlink(missing_ok=True)
            made.symlink_to(version)
            made.replace(self._current)
        _sync(self._folder)

    def _write(self, path: Path, content: Trial | TrialOutcome) -> None:
        made = path.with_name(f"{path.name}.new")
        with made.open("wb") as file:
            file.write(msgspec.json.encode(content))
            file.flush()
            os.fsync(file.fileno())
        made.replace(path)
        _sync(self._folder)

    def _remove_others(self, *kept: str) -> None:
        for one in self._folder.iterdir():
            if one.is_dir() and not one.is_symlink() and one.name not in kept:
                shutil.rmtree(one, ignore_errors=True)


def _unpack(package: Path, part: Path) -> None:
    with zipfile.ZipFile(package) as archive:  # finds its end first, so that what lies before does not matter
        entries = archive.infolist()
        if len(entries) > MAX_FILES or sum(one.file_size for one in entries) > MAX_UNPACKED_BYTES:
            raise NotInstalled("is too large when unpacked")
        archive.extractall(part)  # drops drive letters, absolute paths and `..`
    for path in part.rglob("*"):
        if path.is_file():
            _sync(path)


def _read(path: Path, kind: type[_T]) -> _T | None:
    try:
        return msgspec.json.decode(path.read_bytes(), type=kind)
    except (OSError, msgspec.DecodeError):
        return None


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
