"""A slow journal: nothing is written to the autopilot before its record is durable, and nothing blocks on the disk."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from plan_line import NEW, OLD, InPlaceServer, Line, MemoryJournal, Outcome, PlanUploadWork, SimulatorServer

from onboard_agent.transactions.journal_files import JournalFiles
from onboard_agent.transactions.journal_thread import JournalThread
from wire.plans import PlanKind

MISSION = PlanKind.MISSION
MAX_ASKED = 5


class SlowJournal(MemoryJournal):
    """Completes each write at the fifth query, and not before."""

    def __init__(self) -> None:
        super().__init__()
        self.full = False

    def save(self, kind: PlanKind, record: bytes) -> Any:
        return self._later(lambda: self.records.__setitem__(kind, record), fails=self.full)

    def remove(self, kind: PlanKind) -> Any:
        return self._later(lambda: self.records.pop(kind, None))

    def _later(self, action: Callable[[], Any], *, fails: bool = False) -> Callable[[], bool]:
        asked = 0

        def lasting() -> bool:
            nonlocal asked
            asked += 1
            if asked < MAX_ASKED:
                return False
            if fails:
                raise OSError(28, "No space left on device")
            action()
            return True

        return lasting


def slow_line(server: Any) -> Line:
    line = Line(server)
    line.load(OLD)
    line.journal = SlowJournal()
    line.start_agent()

    def law(_number: int, message: Any) -> int:
        if message.get_type() in ("MISSION_COUNT", "MISSION_ITEM_INT"):
            assert line.journal.records
        return 1

    line.to_server = law
    return line


@pytest.mark.parametrize("server", [SimulatorServer, InPlaceServer])
def test_nothing_is_written_before_the_journal_lasts_and_nothing_is_told_before_it_is_gone(server: Any) -> None:
    line = slow_line(server)
    assert line.upload(NEW).outcome is Outcome.DONE
    assert line.on_board() == NEW
    assert line.journal.records == {} and line.handler.why_no_start is None


@pytest.mark.parametrize("server", [SimulatorServer, InPlaceServer])
def test_it_can_be_stopped_at_any_step_of_a_slow_journal_too(server: Any) -> None:
    seen = set()
    for steps in range(60):
        line = slow_line(server)
        number = line.begin(PlanUploadWork(MISSION, NEW))
        for _ in range(steps):
            line.step()
        line.handler.cancel(number, line.now)
        result = line.result()
        seen.add(result.outcome)
        assert line.on_board() == (NEW if result.outcome is Outcome.DONE else OLD), (steps, result.words)
        assert line.handler.why_no_start is None
        line.start_agent()
        line.run(3.0)
        assert line.journal.records == {} and line.handler.why_no_start is None, steps
    assert seen == {Outcome.CANCELLED, Outcome.DONE}


def test_a_disk_that_is_full_is_told_and_nothing_is_written() -> None:
    line = slow_line(SimulatorServer)
    assert isinstance(line.journal, SlowJournal)
    line.journal.full = True
    result = line.upload(NEW)
    assert (result.outcome, line.on_board()) == (Outcome.FAILED, OLD)
    assert "cannot write its journal (No space left on device)" in result.words


class StuckFiles(JournalFiles):
    """A disk that blocks until released."""

    def __init__(self, directory: Path) -> None:
        super().__init__(directory)
        self.let = threading.Event()

    def save(self, kind: PlanKind, record: bytes) -> None:
        assert self.let.wait(20.0)
        super().save(kind, record)


def test_the_thread_keeps_the_order_and_nobody_waits_for_the_disk(tmp_path: Path) -> None:
    files = StuckFiles(tmp_path)
    journal = JournalThread(files)
    assert journal.load(MISSION) is None
    saved = journal.save(MISSION, b"one")
    removed = journal.remove(PlanKind.FENCE)
    assert not saved() and not removed() and journal.load(MISSION) is None
    files.let.set()
    _until(saved)
    _until(removed)
    assert journal.load(MISSION) == b"one" == JournalFiles(tmp_path).load(MISSION)
    _until(journal.remove(MISSION))
    assert journal.load(MISSION) is None and JournalFiles(tmp_path).load(MISSION) is None


def test_what_the_disk_refuses_is_raised_when_asked_and_changes_nothing(tmp_path: Path) -> None:
    (tmp_path / "plans").write_text("a file is in the way")
    journal = JournalThread(JournalFiles(tmp_path / "plans"))
    saved = journal.save(MISSION, b"one")
    with pytest.raises(OSError, match="exists"):
        _until(saved)


def _until(lasting: Callable[[], bool]) -> None:
    waited = threading.Event()
    for _ in range(2000):
        if lasting():
            return
        waited.wait(0.005)
    raise AssertionError("the disk never did it")
