"""The thread that writes flights: everything in order within half a second, whatever the disk does."""

import errno
import os
import threading
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from server.flights.store.writer import FULL, TOO_LARGE, FlightFile, FlightWriter

NOW = datetime(2026, 1, 1, tzinfo=UTC)
DEADLINE_S = 30.0


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


class Disk:
    """os.write, with failures by name."""

    def __init__(self) -> None:
        self.error = 0
        self.short = False
        self.gate = threading.Event()
        self.gate.set()

    def write(self, descriptor: int, piece: bytes) -> int:
        assert self.gate.wait(DEADLINE_S)
        if self.error:
            os.write(descriptor, piece[:3])  # a full disk takes the beginning
            raise OSError(self.error, os.strerror(self.error))
        return os.write(descriptor, piece[:5] if self.short else piece)


@pytest.fixture
def disk() -> Disk:
    return Disk()


@pytest.fixture
def writer(disk: Disk) -> Iterator[FlightWriter]:
    writer = FlightWriter(max_waiting_bytes=1000, write=disk.write)
    writer.start()
    yield writer
    disk.gate.set()
    assert writer.stop()


def flight(writer: FlightWriter, folder: Path, name: str = "a", largest_bytes: int = 10_000) -> FlightFile:
    paths = {"tlog": folder / "drone-1" / f"{name}.tlog", "index": folder / "drone-1" / f"{name}.jsonl"}
    return FlightFile(writer, drone_id=1, file=name, **paths, largest_bytes=largest_bytes)


def test_chunks_and_lines_arrive_in_order(writer: FlightWriter, tmp_path: Path) -> None:
    file = flight(writer, tmp_path)
    began = time.monotonic()
    for number in range(5):
        file.frames(b"%d," % number, 1)
        file.event(b"line %d" % number)
    until(lambda: file.bytes_written == 10)
    assert time.monotonic() - began < 5
    assert file.tlog.read_bytes() == b"0,1,2,3,4,"
    assert file.index.read_bytes() == b"".join(b"line %d\n" % number for number in range(5))
    file.end(NOW, "")
    until(lambda: file.closed)
    assert (writer.frames_written, writer.waiting_bytes, file.frames_lost) == (5, 0, 0)


def test_stopping_writes_the_rest(tmp_path: Path) -> None:
    writer = FlightWriter()
    writer.start()
    file = flight(writer, tmp_path)
    file.frames(b"x" * 500, 3)
    file.end(NOW, "the tower was stopped")
    assert writer.stop()
    assert file.tlog.stat().st_size == 500
    assert file.closed


def test_a_full_disk_leaves_whole_chunks_and_other_flights_go_on(
    writer: FlightWriter, disk: Disk, tmp_path: Path
) -> None:
    file = flight(writer, tmp_path)
    file.frames(b"whole,", 2)
    until(lambda: file.bytes_written == 6)
    disk.error = errno.ENOSPC
    file.frames(b"lost,", 7)
    until(lambda: bool(file.problem))
    assert (file.problem, writer.failing) == (FULL, True)
    file.frames(b"refused,", 1)
    until(lambda: file.frames_lost == 8)
    assert file.tlog.read_bytes() == b"whole,"
    disk.error = 0
    other = flight(writer, tmp_path, "b")
    other.frames(b"fine", 1)
    until(lambda: other.bytes_written == 4)
    assert not writer.failing
    assert (writer.frames_written, writer.frames_unwritten + writer.frames_refused) == (3, 8)


def test_a_disk_that_hangs_costs_frames_and_never_the_loop(writer: FlightWriter, disk: Disk, tmp_path: Path) -> None:
    file = flight(writer, tmp_path)
    disk.gate.clear()
    began = time.monotonic()
    for _ in range(100):
        file.frames(b"x" * 100, 1)
    assert time.monotonic() - began < 1.0
    assert writer.waiting_bytes <= 1000
    assert file.frames_lost >= 90
    disk.gate.set()
    until(lambda: writer.waiting_bytes == 0)
    assert file.tlog.stat().st_size == 100 * (100 - file.frames_lost)
    assert not file.problem  # it goes on when the disk does
    file.frames(b"y", 1)
    until(lambda: file.tlog.read_bytes().endswith(b"y"))


def test_short_writes_are_completed(writer: FlightWriter, disk: Disk, tmp_path: Path) -> None:
    disk.short = True
    file = flight(writer, tmp_path)
    file.frames(b"0123456789abcdefg", 1)
    until(lambda: file.bytes_written == 17)
    assert file.tlog.read_bytes() == b"0123456789abcdefg"


def test_a_flight_ends_at_its_largest_size(writer: FlightWriter, tmp_path: Path) -> None:
    file = flight(writer, tmp_path, largest_bytes=10)
    file.frames(b"0123456789", 1)
    assert file.problem == TOO_LARGE
    file.frames(b"more", 1)
    until(lambda: file.bytes_written == 10)
    assert (file.tlog.read_bytes(), writer.failing) == (b"0123456789", False)


def test_a_folder_that_cannot_be_made_is_a_problem(writer: FlightWriter, tmp_path: Path) -> None:
    (tmp_path / "drone-1").write_text("in the way")
    file = flight(writer, tmp_path)
    file.frames(b"x", 1)
    until(lambda: bool(file.problem))
    assert "disk" in file.problem


def test_a_probe_finds_that_the_disk_is_back(writer: FlightWriter, disk: Disk, tmp_path: Path) -> None:
    disk.error = errno.EIO
    file = flight(writer, tmp_path)
    file.frames(b"x", 1)
    until(lambda: writer.failing)
    assert not writer.probe(tmp_path)
    assert writer.failing
    disk.error = 0
    assert writer.probe(tmp_path)
    assert not writer.failing
    assert [path.name for path in tmp_path.iterdir()] == ["drone-1"]
