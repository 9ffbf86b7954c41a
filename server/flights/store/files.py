"""The folder of flights: `drone-<id>/<file>.tlog` and, beside it, the index `<file>.jsonl`.

Blocking; call it in a thread. A file grows while its flight is recorded, and is never changed afterwards. After a crash
what is not whole is cut off (`close_unfinished`).
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from server.flights.core.figures import FiguresReader, FlightFigures
from server.flights.core.index import IndexSummary, at_of, entry_of, read_index, whole_lines
from server.flights.core.tlog import Entry, is_of_one_vehicle, read_entries
from server.flights.core.track import FlightSummary
from server.storage.file_budget import disk_takes, drone_folders, drones_with_files, folder_of, remove_folders
from server.storage.folder_id import open_folder
from wire.ids import DroneId
from wire.own_system import OwnSystem

TLOG: Final = ".tlog"
INDEX: Final = ".jsonl"
_OURS: Final = re.compile(r"([0-9a-f]{16})\.jsonl")
MAX_TORN_BYTES: Final = 1024 * 1024
"""What a crash leaves behind the last whole frame. More than that is no torn end, and stays for people to look at."""
ENTRIES_A_TURN: Final = 500
TURN_S: Final = 0.001
"""The tower's loop comes first: reading a long flight takes the interpreter in small pieces."""


@dataclass(frozen=True)
class FlightFacts:
    """What the two files say. `torn_bytes`: cut off, or left where it is too much."""

    summary: FlightSummary
    index: IndexSummary
    figures: FlightFigures
    size_bytes: int
    torn_bytes: int


@dataclass(frozen=True)
class FoundFlight:
    """Files that no row of the database knows."""

    drone_id: int
    file: str
    size_bytes: int
    kept_at: float


class FlightFiles:
    """`root`: need not exist yet. `id`: empty until opened."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.id = ""

    def open(self) -> None:
        """Reads the folder's id, or assigns one. Raises OSError."""
        self.id = open_folder(self.root)

    def path(self, drone_id: int, file: str, ending: str) -> Path:
        """Returns the path of a file, whether it exists or not."""
        return folder_of(self.root, DroneId(drone_id)) / f"{file}{ending}"

    def remove(self, drone_id: int, file: str) -> None:
        """Removes both files, and what was fetched for them. Raises OSError."""
        for ending in (TLOG, INDEX):
            self.path(drone_id, file, ending).unlink(missing_ok=True)
        for part in folder_of(self.root, DroneId(drone_id)).glob(f"{file}.*.part"):
            part.unlink(missing_ok=True)

    def has_room(self, coming_bytes: int) -> bool:
        """Whether the disk has room. Raises OSError."""
        return disk_takes(self.root, coming_bytes)

    def drone_ids(self) -> frozenset[int]:
        """Drones with files, including deleted ones."""
        return drones_with_files(self.root)

    def remove_drones(self, drone_ids: Iterable[int]) -> None:
        """Removes all files of deleted drones."""
        remove_folders(self.root, drone_ids)

    def unknown(self, known: Container[str]) -> list[FoundFlight]:
        """Returns the flights that are not among the known ones, oldest first. Raises OSError."""
        found: list[FoundFlight] = []
        for drone_id, folder in drone_folders(self.root):
            for path in list(folder.iterdir()):
                ours = _OURS.fullmatch(path.name)
                if ours is not None and ours[1] not in known:
                    size = self.size(drone_id, ours[1])
                    found.append(FoundFlight(drone_id, ours[1], size, path.stat().st_mtime))
        return sorted(found, key=lambda one: one.kept_at)

    def size(self, drone_id: int, file: str) -> int:
        """Returns the bytes of both files; 0 if they are gone."""
        total = 0
        for ending in (TLOG, INDEX):
            try:
                total += self.path(drone_id, file, ending).stat().st_size
            except FileNotFoundError:
                continue
        return total

    def read_index(self, drone_id: int, file: str) -> list[bytes]:
        """Returns the whole lines after the head. Raises OSError."""
        return whole_lines(self.path(drone_id, file, INDEX).read_bytes())[1:]

    def close_unfinished(self, drone_id: int, file: str) -> FlightFacts:
        """Cuts off what is not whole, makes both files last, and sums them up. Raises OSError, NoIndex."""
        index_path, tlog_path = self.path(drone_id, file, INDEX), self.path(drone_id, file, TLOG)
        content = index_path.read_bytes()
        lines = whole_lines(content)
        index = read_index(lines)
        _cut(index_path, len(content), sum(len(line) + 1 for line in lines))
        summary, figures = _summed_up(tlog_path, index, lines)
        torn_bytes = 0
        if tlog_path.exists():
            size = tlog_path.stat().st_size
            torn_bytes = size - summary.whole_bytes
            if torn_bytes <= MAX_TORN_BYTES:
                _cut(tlog_path, size, summary.whole_bytes)
        return FlightFacts(summary, index, figures, self.size(drone_id, file), torn_bytes)

    def figures(self, drone_id: int, file: str) -> FlightFigures:
        """The figures of a flight that is over; changes no file. Raises OSError, NoIndex."""
        lines = whole_lines(self.path(drone_id, file, INDEX).read_bytes())
        return _summed_up(self.path(drone_id, file, TLOG), read_index(lines), lines)[1]


def entries_in_turns(path: Path) -> Iterator[Entry]:
    """Reads a telemetry log in small pieces: the tower's loop comes first. Blocking. Raises OSError."""
    with path.open("rb") as file:
        for number, entry in enumerate(read_entries(file)):
            yield entry
            if number % ENTRIES_A_TURN == ENTRIES_A_TURN - 1:
                time.sleep(TURN_S)


def _summed_up(tlog_path: Path, index: IndexSummary, lines: list[bytes]) -> tuple[FlightSummary, FlightFigures]:
    """One reading of the telemetry log. Raises OSError."""
    summary = FlightSummary(index.began_us)
    entries = sorted(map(entry_of, lines[1:]), key=at_of)
    reader = FiguresReader(entries, index.began_us, index.ended_us)
    if tlog_path.exists():
        own = OwnSystem(judged=True)
        for entry in entries_in_turns(tlog_path):
            if not is_of_one_vehicle(own, entry.frame, entry.at_us):
                summary.skip(entry)
                continue
            before_m = summary.distance_m
            summary.take(entry)
            reader.take(entry, summary.distance_m - before_m)
    return summary, reader.figures(max_height_m=summary.max_height_m)


def _cut(path: Path, size: int, whole: int) -> None:
    with path.open("r+b") as file:
        if size > whole:
            file.truncate(whole)
        os.fdatasync(file.fileno())
