"""Stores the journal in the agent's state directory: one file for each kind of plan, replaced atomically."""

import os
from pathlib import Path

from wire.plans import PlanKind


class JournalFiles:
    """A JournalStore. The first save creates the directory."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory

    def load(self, kind: PlanKind) -> bytes | None:
        """The record, or None."""
        try:
            return self._path(kind).read_bytes()
        except FileNotFoundError:
            return None

    def save(self, kind: PlanKind, record: bytes) -> None:
        """Writes a new file, syncs it, then renames it: after a power cut the record is the old or the new one."""
        self._directory.mkdir(parents=True, exist_ok=True)
        beside = self._path(kind).with_suffix(".new")
        with beside.open("wb") as file:
            file.write(record)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(self._path(kind))
        self._bring_directory_to_disk()

    def remove(self, kind: PlanKind) -> None:
        """Deletes the record durably, so that a power cut does not restore it."""
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
