"""The files of the black box: written by a thread, read in pieces, bounded."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from frames_of_flight import attitude

from onboard_agent.black_box import flight_files
from onboard_agent.black_box.disk import FULL, BlackBoxDisk
from onboard_agent.black_box.flight_files import CSV, INDEX, TLOG, FlightFiles, entries_in
from wire.black_box import BlackBoxPiece, BlackBoxWanted, inflated

AT_US = 1_800_000_000_000_000


def entries(first: int, count: int) -> bytes:
    """One frame each 10 ms."""
    return b"".join((AT_US + number * 10_000).to_bytes(8) + attitude(number) for number in range(first, first + count))


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@contextmanager
def disk_at(folder: Path, budget_bytes: int = 10**9) -> Iterator[BlackBoxDisk]:
    disk = BlackBoxDisk(folder, budget_bytes)
    disk.start()
    try:
        yield disk
    finally:
        disk.stop()


def flown(disk: BlackBoxDisk, count: int = 1000, *, first: int = 0) -> None:
    disk.begin(AT_US + first * 10_000)
    for begin in range(first, first + count, 100):
        disk.frames(entries(begin, 100), AT_US + (begin + 99) * 10_000)
    disk.end(AT_US + (first + count) * 10_000)


def is_over(disk: BlackBoxDisk, began_us: int) -> bool:
    ended = any(one.began_us == began_us and one.ended_us is not None for one in disk.flights)
    return ended and not disk._unfinished


def fetched(disk: BlackBoxDisk, name: str, from_us: int, to_us: int) -> bytes:
    content, at, request = b"", 0, 0
    while True:
        request += 1
        disk.want(BlackBoxWanted(request=request, flight=name, from_us=from_us, to_us=to_us, at=at))
        until(lambda request=request: disk.answer is not None and disk.answer.request == request)  # type: ignore[misc]
        answer: BlackBoxPiece | None = disk.answer
        assert answer is not None and not answer.words
        content += inflated(answer.data)
        at = answer.next
        if answer.last:
            return content


def test_a_flight_is_written_and_read_back_in_pieces(tmp_path: Path) -> None:
    with disk_at(tmp_path) as disk:
        flown(disk)
        until(lambda: bool(disk.flights) and (tmp_path / f"{disk.flights[0].name}{CSV}").exists())
        (flight,) = disk.flights
        assert flight.ended_us == AT_US + 10_000_000
        assert (tmp_path / f"{flight.name}{TLOG}").read_bytes() == entries(0, 1000)
        assert len((tmp_path / f"{flight.name}{CSV}").read_text().splitlines()) == 1001
        part = fetched(disk, flight.name, AT_US + 2_500_000, AT_US + 8_000_000)
        assert part == entries(250, 551), "whole entries of just this time"


def test_an_unknown_flight_is_answered(tmp_path: Path) -> None:
    with disk_at(tmp_path) as disk:
        disk.want(BlackBoxWanted(request=7, flight="20200101T000000-0000", from_us=0, to_us=1))
        until(lambda: disk.answer is not None)
        assert disk.answer is not None and disk.answer.words and disk.answer.last


def test_a_crash_leaves_a_file_that_the_next_start_completes(tmp_path: Path) -> None:
    with disk_at(tmp_path) as disk:
        flown(disk)
        until(lambda: bool(list(tmp_path.glob(f"*{CSV}"))))
    (tlog,), (index,), (csv,) = (list(tmp_path.glob(f"*{ending}")) for ending in (TLOG, INDEX, CSV))
    csv.unlink()
    lines = index.read_bytes().split(b"\n")[:-2]
    index.write_bytes(b"\n".join(lines) + b'\n{"kind":"at","at')
    tlog.write_bytes(tlog.read_bytes()[:-5])

    with disk_at(tmp_path) as disk:
        until(lambda: csv.exists() and is_over(disk, AT_US))
        assert disk.flights[0].ended_us == AT_US + 998 * 10_000
    assert tlog.read_bytes() == entries(0, 999)
    assert sum(1 for _ in entries_in(tlog)) == 999


def test_the_oldest_flights_make_room(tmp_path: Path) -> None:
    size = len(entries(0, 1000))
    with disk_at(tmp_path, 5 * size) as disk:
        for number in range(5):
            flown(disk, first=number * 100_000)
            until(lambda number=number: is_over(disk, AT_US + number * 1_000_000_000))  # type: ignore[misc]
        names = FlightFiles(tmp_path, 0).names()
        assert 1 <= len(names) < 5
        assert disk.flights[-1].began_us == AT_US + 400_000 * 10_000, "the newest is there"


def test_a_full_disk_is_a_problem_and_ends_with_the_next_flight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with disk_at(tmp_path) as disk:
        until(lambda: not disk._unfinished)
        monkeypatch.setattr(flight_files, "LEFT_FREE_BYTES", 2**63)
        flown(disk)
        until(lambda: disk.problem == FULL)
        monkeypatch.undo()
        flown(disk, first=10_000)
        until(lambda: disk.problem == "" and bool(disk.flights) and disk.flights[-1].ended_us is not None)
        assert disk.flights[-1].began_us == AT_US + 100_000_000


def test_a_folder_that_cannot_be_made_stops_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    with disk_at(tmp_path / "file" / "box") as disk:
        flown(disk)
        until(lambda: disk.problem != "")
        assert disk._thread.is_alive()
