"""The state of an open hold that survives the agent's process: in memory, and as a file."""

from pathlib import Path

import pytest

from onboard_agent.failsafe.hold_files import HoldFiles
from onboard_agent.failsafe.hold_memory import HoldMemory, HoldRecord
from wire.control_messages import SafetySettings
from wire.open_holds import LostAction


class CountingStore:
    def __init__(self, record: bytes | None = None) -> None:
        self.record = record
        self.calls: list[str] = []

    def load(self) -> bytes | None:
        return self.record

    def save(self, record: bytes) -> None:
        self.calls.append("save")
        self.record = record

    def remove(self) -> None:
        self.calls.append("remove")
        self.record = None

    def close(self) -> None:
        self.calls.append("close")


def record(*, held: bool = True, why: str = "taken") -> HoldRecord:
    settings = SafetySettings(lost_action=LostAction.LAND, lost_action_s=7.0, hold_ladder=("BRAKE",))
    return HoldRecord(system_id=3, sticks=True, held=held, why=why, settings=settings)


def test_what_is_kept_is_what_the_next_process_finds_once() -> None:
    store = CountingStore()
    HoldMemory(store).keep(record())
    memory = HoldMemory(store)
    assert memory.left == record()
    memory.keep(record(why="again"))
    assert memory.left is None
    assert HoldMemory(store).left == record(why="again")


def test_only_what_has_changed_is_written() -> None:
    store = CountingStore()
    memory = HoldMemory(store)
    for _ in range(10):
        memory.keep(None)
    assert store.calls == []
    for _ in range(10):
        memory.keep(record())
    for _ in range(10):
        memory.keep(record(held=False))
    for _ in range(10):
        memory.keep(None)
    assert store.calls == ["save", "save", "remove"]


def test_what_the_process_before_has_left_is_removed_when_it_is_over() -> None:
    store = CountingStore()
    HoldMemory(store).keep(record())
    memory = HoldMemory(store)
    memory.keep(None)
    assert store.record is None
    assert HoldMemory(store).left is None


@pytest.mark.parametrize("left", [b"", b"\xff\xfe", b"{}", b'{"system_id": 1', b"[1, 2]"])
def test_what_cannot_be_read_is_nothing(left: bytes) -> None:
    assert HoldMemory(CountingStore(left)).left is None


def written_by(files: HoldFiles, *records: bytes | None) -> None:
    """Writes the records in order. Returns once all are written."""
    for one in records:
        files.remove() if one is None else files.save(one)
    files.close()


def test_a_file_outlasts_the_process(tmp_path: Path) -> None:
    assert HoldFiles(tmp_path).load() is None
    written_by(HoldFiles(tmp_path), b"one", b"two", None, b"three")
    assert HoldFiles(tmp_path).load() == b"three"
    assert [path.name for path in tmp_path.iterdir()] == ["open-hold.json"], "nothing is left beside it"
    written_by(HoldFiles(tmp_path), None)
    assert HoldFiles(tmp_path).load() is None


def test_a_folder_that_cannot_be_written_is_said_and_nothing_else(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    written_by(HoldFiles(tmp_path / "gone"), b"one")
    assert HoldFiles(tmp_path / "gone").load() is None
    assert "will not know" in caplog.text
