"""Stores remembered parameter tables as files in the agent's state directory, one for each autopilot."""

import contextlib
import logging
from pathlib import Path
from typing import Final

_log = logging.getLogger(__name__)

MAX_FILES: Final = 8
"""An agent may be moved between autopilots; the oldest file is deleted."""


class ParameterFiles:
    """A ParameterStore. Does not sync to disk: a file damaged by a power cut counts as no record.

    `directory`: None if nothing is to be kept.
    """

    def __init__(self, directory: Path | None) -> None:
        self._directory = directory

    def load(self, autopilot: str) -> bytes | None:
        """Returns the record, or None if there is none or it cannot be read."""
        if self._directory is None:
            return None
        with contextlib.suppress(OSError):
            return _path(self._directory, autopilot).read_bytes()
        return None

    def save(self, autopilot: str, record: bytes) -> None:
        """Writes a new file, then renames it. Logs errors; the agent then works without a remembered table."""
        if self._directory is None:
            return
        path = _path(self._directory, autopilot)
        beside = path.with_suffix(".new")
        try:
            self._directory.mkdir(parents=True, exist_ok=True)
            beside.write_bytes(record)
            beside.replace(path)
            _make_room(self._directory)
        except OSError as error:
            _log.warning("the parameters cannot be remembered: %s", error)


def _make_room(directory: Path) -> None:
    files = sorted(directory.glob("*.parameters"), key=lambda path: path.stat().st_mtime)
    for path in files[:-MAX_FILES]:
        path.unlink()


def _path(directory: Path, autopilot: str) -> Path:
    return directory / f"{autopilot}.parameters"
