"""Whatever crashes, and when: the plan on board is the old or the new one, complete, or the agent refuses to fly it.

The agent is killed at every step of an upload, at every call of its journal, and again during its recovery. The
autopilot writes in place and truncates at MISSION_COUNT, as ArduPilot does, or is the simulator's own.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plan_line import (
    NEW,
    OLD,
    Failure,
    InPlaceServer,
    Killed,
    Line,
    PlanClearWork,
    PlanUploadWork,
    SimulatorServer,
    waypoints,
)
from worlds.tiers import examples

from onboard_agent.transactions.journal import UNREADABLE, read_intent
from onboard_agent.transactions.journal_files import JournalFiles
from wire.plans import Plan, PlanItem, PlanKind
from wire.transactions import Outcome

MISSION = PlanKind.MISSION
IN_PLACE = partial(SimulatorServer, failures=[Failure.MISSION_WRITTEN_IN_PLACE])
SERVERS = {"beside": SimulatorServer, "in-place": IN_PLACE, "in-place-denying": InPlaceServer}
QUIET_S = 60.0


def watched_line(server: Any, old: Plan, new: Plan) -> Line:
    """Checks the invariant at each step."""
    line = Line(server)
    line.load(old)

    def law() -> None:
        if line.on_board() not in (old, new):
            assert line.handler.why_no_start is not None

    line.on_step = law
    return line


def settle(line: Line) -> None:
    until = line.now + QUIET_S
    while line.handler.why_no_start is not None and line.now < until:
        line.step()


def work_for(new: Plan) -> PlanUploadWork | PlanClearWork:
    return PlanUploadWork(MISSION, new) if new else PlanClearWork(MISSION)


@pytest.mark.parametrize("server", SERVERS.values(), ids=SERVERS)
@pytest.mark.parametrize(
    ("old", "new"), [(OLD, NEW), (NEW, OLD), (OLD, ()), ((), NEW)], ids=["longer", "shorter", "cleared", "first"]
)
def test_the_agent_killed_at_every_step_of_an_upload(server: Any, old: Plan, new: Plan) -> None:
    halves, ends = 0, set()
    steps = 0
    while True:
        line = watched_line(server, old, new)
        number = line.begin(work_for(new))
        for _ in range(steps):
            line.step()
        over = any(
            getattr(reported, "outcome", None) is not None and reported.id == number for reported in line.reports
        )
        halves += line.on_board() not in (old, new)
        line.start_agent()
        settle(line)
        assert line.handler.why_no_start is None and line.journal.records == {}, f"killed after {steps} steps"
        assert line.on_board() in (old, new), f"killed after {steps} steps"
        ends.add(line.on_board())
        if over:
            break
        steps += 1
    assert ends == {old, new}
    assert steps > (8 if new else 4)
    if server is not SERVERS["beside"] and old and new:
        assert halves  # without half plans the test would prove nothing


@pytest.mark.parametrize("server", SERVERS.values(), ids=SERVERS)
@pytest.mark.parametrize("call", range(4))
def test_the_agent_killed_before_and_after_each_word_of_its_journal(server: Any, call: int) -> None:
    line = watched_line(server, OLD, NEW)
    line.begin(work_for(NEW))
    line.journal.dies_at = call
    with pytest.raises(Killed):
        line.run(30.0)
    line.start_agent()
    settle(line)
    assert line.on_board() == (OLD if call < 2 else NEW)
    assert line.handler.why_no_start is None and line.journal.records == {}


STEPS = st.integers(0, 400)
FAULTS = st.sampled_from(["kill", "reset", "silence", "cancel", "epoch", "upload"])


@pytest.mark.parametrize("server", SERVERS.values(), ids=SERVERS)
@settings(max_examples=examples(20, long=120), deadline=None)
@given(faults=st.lists(st.tuples(STEPS, FAULTS), max_size=6), lost=st.sets(st.integers(1, 80), max_size=25))
def test_any_story_of_kills_resets_silences_and_losses(
    server: Any, faults: list[tuple[int, str]], lost: set[int]
) -> None:
    line = watched_line(server, OLD, NEW)
    line.to_server = lambda number, _message: 0 if number in lost else 1
    line.to_agent = lambda number, _message: 0 if number + 7 in lost else 1
    line.begin(work_for(NEW))
    epoch = 1
    for steps, fault in faults:
        line.run(steps / 100)
        if fault == "kill":
            line.start_agent()
        elif fault == "reset":
            line.server.reset()
            line.silent_until = line.now + 3.0
        elif fault == "silence":
            line.silent_until = line.now + 5.0
        elif fault == "cancel":
            line.handler.cancel(1, line.now)
        elif fault == "epoch":
            epoch += 1
            line.handler.epoch_changed(epoch, line.now)
        else:
            line.begin(work_for(NEW), epoch=epoch)
    for _ in range(6):
        settle(line)
    assert line.handler.why_no_start is None and line.journal.records == {}
    assert line.on_board() in (OLD, NEW)


@pytest.mark.parametrize("server", SERVERS.values(), ids=SERVERS)
def test_a_plan_that_differs_only_in_what_autopilots_drop_is_not_taken_for_the_new_one(server: Any) -> None:
    """Half of it would pass a tolerant comparison: after a crash every bit counts."""
    new = tuple(PlanItem(16, 3, (5.0, 0.0, 0.0, 0.0), item.x, item.y, item.z) for item in OLD)
    for steps in range(24):
        line = watched_line(server, OLD, new)
        line.begin(work_for(new))
        for _ in range(steps):
            line.step()
        line.start_agent()
        settle(line)
        assert line.on_board() in (OLD, new)


def broken_off(server: Any) -> Line:
    """The agent was killed with half a plan on board, and has just restarted."""
    line = Line(server)
    line.load(OLD)
    line.begin(work_for(NEW))
    while line.on_board() in (OLD, NEW):
        line.step()
    line.start_agent()
    return line


def test_the_old_plan_is_not_forgotten_where_an_upload_comes_before_the_recovery_and_fails_too() -> None:
    line = broken_off(IN_PLACE)
    result = line.upload((*waypoints(3, alt_m=60.0), PlanItem(31000)))
    assert (result.outcome, result.item) == (Outcome.FAILED, 3)
    assert line.on_board() == OLD
    assert line.handler.why_no_start is None


def test_a_recovery_waits_while_the_autopilot_denies_and_is_over_when_that_lapses() -> None:
    line = broken_off(InPlaceServer)
    line.run(7.9)
    assert line.on_board() not in (OLD, NEW) and line.handler.why_no_start is not None
    line.run(1.7)
    assert line.on_board() == OLD and line.handler.why_no_start is None


@pytest.mark.parametrize("record", [b"", b"{", b'{"old": 3}', b"\xff\xfe", b"[" * 5000])
def test_a_journal_that_nobody_can_read_refuses_flight_until_a_plan_was_proved(record: bytes) -> None:
    line = Line(SimulatorServer)
    line.load(OLD)
    line.journal.records[MISSION] = record
    assert read_intent(line.journal, MISSION) is UNREADABLE
    line.start_agent()
    line.run(30.0)
    assert line.on_board() == OLD  # nothing is known, so it is left alone
    assert line.handler.why_no_start is not None
    assert line.upload(NEW).outcome is Outcome.DONE
    assert line.handler.why_no_start is None and line.journal.records == {}


def test_the_same_plan_uploaded_again_proves_what_was_not_known() -> None:
    line = Line(SimulatorServer)
    line.load(OLD)
    line.journal.records[MISSION] = b"{"
    line.start_agent()
    assert "already" in line.upload(OLD).words
    assert line.handler.why_no_start is None and line.journal.records == {}


def test_the_journal_on_disk_is_replaced_whole_and_removed(tmp_path: Path) -> None:
    files = JournalFiles(tmp_path / "state" / "plans")
    assert files.load(MISSION) is None
    files.remove(MISSION)
    files.save(MISSION, b"one")
    files.save(MISSION, b"another")
    files.save(PlanKind.FENCE, b"fence")
    assert JournalFiles(tmp_path / "state" / "plans").load(MISSION) == b"another"
    assert sorted(path.name for path in (tmp_path / "state" / "plans").iterdir()) == ["fence.intent", "mission.intent"]
    files.remove(MISSION)
    assert files.load(MISSION) is None and files.load(PlanKind.FENCE) == b"fence"


def test_a_crash_while_the_journal_is_written_leaves_the_old_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = JournalFiles(tmp_path)
    files.save(MISSION, b"old")

    def power_cut(_self: Path, _target: Path) -> None:
        raise Killed

    monkeypatch.setattr(Path, "replace", power_cut)
    with pytest.raises(Killed):
        files.save(MISSION, b"new")
    assert files.load(MISSION) == b"old"
