"""The files that the tower keeps: complete or not at all, one for each log, within a budget."""

import os
from pathlib import Path

import pytest

from server.logs.store.quota import FlightLogQuota
from server.storage import file_budget
from server.storage.file_budget import StorageFull
from wire.ids import DroneId

HAWK, CROW = DroneId(3), DroneId(4)


def quota(root: Path, *, budget: int = 100, largest: int = 60) -> FlightLogQuota:
    return FlightLogQuota(root / "files", budget_bytes=budget, largest_bytes=largest)


def put(
    on: FlightLogQuota, log_id: int, size: int, *, drone: DroneId = HAWK, began: int | None = 5, at: float | None = None
) -> None:
    arriving = on.begin(drone, 1, size, 1)
    on.write(arriving, b"x" * size)
    arriving.file.flush()
    if at is not None:
        arriving.file.close()
        os.utime(arriving.path, (at, at))
    on.keep(arriving, log_id, began)
    on.discard(arriving)


def kept(on: FlightLogQuota, drone: DroneId = HAWK) -> list[tuple[int, int | None, int]]:
    return [(one.log_id, one.began_unix_s, one.size_bytes) for one in on.of(drone)]


def test_a_log_is_kept_by_drone_and_number_and_a_newer_file_takes_its_place(tmp_path: Path) -> None:
    on = quota(tmp_path)
    put(on, 1, 10)
    put(on, 2, 20, began=None)
    put(on, 1, 30, began=9)
    put(on, 1, 5, drone=CROW)
    assert kept(on) == [(2, None, 20), (1, 9, 30)]
    assert kept(on, CROW) == [(1, 5, 5)]
    assert kept(on, DroneId(9)) == []


def test_the_oldest_go_when_the_budget_is_used_up(tmp_path: Path) -> None:
    on = quota(tmp_path)
    put(on, 1, 40, at=1000)
    put(on, 2, 40, drone=CROW, at=2000)
    put(on, 3, 50, at=3000)
    assert (kept(on), kept(on, CROW)) == ([(3, 5, 50)], [(2, 5, 40)])


def test_what_is_too_large_or_would_fill_the_disk_is_not_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    on = quota(tmp_path)
    put(on, 1, 40)
    with pytest.raises(StorageFull):
        on.begin(HAWK, 2, 61, 1)
    monkeypatch.setattr(file_budget, "MIN_FREE_BYTES", 1 << 62)
    with pytest.raises(StorageFull, match="disk"):
        on.begin(HAWK, 2, 10, 1)
    assert kept(on) == [(1, 5, 40)]


def test_halves_and_what_was_of_drones_that_were_deleted_is_swept_away(tmp_path: Path) -> None:
    on = quota(tmp_path)
    on.sweep({CROW})  # nothing there yet
    put(on, 1, 10)
    put(on, 1, 10, drone=CROW)
    on.begin(HAWK, 7, 10, 1).file.close()
    (tmp_path / "files" / "letters.txt").write_text("not ours")
    assert on.drone_ids() == {HAWK, CROW}
    on.sweep({CROW})
    assert (kept(on), kept(on, CROW)) == ([(1, 5, 10)], [])
    assert sorted(path.name for path in (tmp_path / "files").rglob("*") if path.is_file()) == ["1-5.bin", "letters.txt"]
