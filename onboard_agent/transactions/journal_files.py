"""The journal as files in the agent's state directory: one for each kind of plan, replaced atomically."""

import os
from pathlib import Path

from wire.plans import PlanKind


class JournalFiles:
    """A JournalStore. The directory is made when the first record is saved."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory

    def load(self, kind: PlanKind) -> bytes | None:
        """The record, or None."""
        try:
            return self._path(kind).read_bytes()
        except FileNotFoundError:
            return None

    def save(self, kind: PlanKind, record: bytes) -> None:
        """Written beside, brought to the disk, then renamed: after a power cut it is the old record or this one."""
        self._directory.mkdir(parents=True, exist_ok=True)
        beside = self._path(kind).with_suffix(".new")
        with beside.open("wb") as file:
            file.write(record)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(self._path(kind))
        self._bring_directory_to_disk()

    def remove(self, kind: PlanKind) -> None:
        """Gone for good, after a power cut too."""
        if self._path(kind).exists():
            self._path(kind).unlink()
            self._bring_directory_to_disk()

    def _path(self, kind: PlanKind) -> Path:
        return self._directory / f"{kind.value}.intent"

    def _bring_directory_to_disk(self) -> None:
        if os.name == "nt":  # pragma: no cover - a directory cannot be opened there
            return
        descriptor = os.open(self._directory, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
