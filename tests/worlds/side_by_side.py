"""How parallel test workers share a machine (`pytest -n 3`, as `make test` does).

A module's tests stay together, so that their fixtures are made once. A module that measures short times has the machine
to itself.
"""

import fcntl
import json
import os
import tempfile
from pathlib import Path
from typing import Any, Final

import pytest
from worlds.costs import WALL
from xdist.scheduler.loadscope import LoadScopeScheduling

ALONE: Final = ("test_bench_network.py",)
"""Modules whose measurements parallel tests would spoil: while one of them runs, no other test does."""

LENGTHS: Final = Path(__file__).resolve().parents[1] / "costs.json"
"""What each module took when it was measured last (`worlds.costs`)."""
BROWSERS: Final = "tests/e2e/"
BROWSERS_AT_A_TIME: Final = 2
"""A browser test keeps a core busy, and its drones fly on while it waits for its turn: with more at a time each of them
takes longer and costs more."""
UNKNOWN_S: Final = 30.0
"""The length of a module that was never measured."""


def order_of_start(items: list[pytest.Item]) -> None:
    """Puts first the tests that run alone, then the longest modules, so that none of them delays the end of the run."""
    costs = json.loads(LENGTHS.read_text()) if LENGTHS.exists() else {}

    def rank(item: pytest.Item) -> tuple[bool, float, str]:
        module = item.nodeid.split("::")[0]
        return not _is_alone(item), -costs.get(module, {}).get(WALL, UNKNOWN_S), module

    items.sort(key=rank)


class Groups(LoadScopeScheduling):  # type: ignore[misc]
    """Gives whole groups to workers, in the order of the collection, with few browsers at a time."""

    def __init__(self, config: pytest.Config, log: Any) -> None:
        config.option.loadscopereorder = False
        super().__init__(config, log)

    def _split_scope(self, nodeid: str) -> str:
        return nodeid.split("::")[0]

    def _assign_work_unit(self, node: Any) -> None:
        """Takes the next module without a browser while enough others have one."""
        browsers = sum(
            any(scope.startswith(BROWSERS) and not all(tests.values()) for scope, tests in work.items())
            for other, work in self.assigned_work.items()
            if other is not node
        )
        if browsers >= BROWSERS_AT_A_TIME:
            first = next((scope for scope in self.workqueue if not scope.startswith(BROWSERS)), None)
            if first is not None:
                self.workqueue.move_to_end(first, last=False)
        super()._assign_work_unit(node)

    def schedule(self) -> None:
        """Gives each worker work. A worker keeps its last test until it has another one or is told to end, so that one
        group of one test would be waited for without end."""
        super().schedule()
        for node in self.nodes:
            self._reschedule(node)

    def remove_node(self, node: Any) -> str | None:
        """Returns the test that ended its worker. The base class would give it to the next worker too, without end; and
        the groups that are over, for whose tests it would wait without end."""
        groups = self.assigned_work[node]
        crashed = next((test for group in groups.values() for test, is_done in group.items() if not is_done), None)
        for group in groups.values():
            if crashed in group:
                group[crashed] = True
        for name in [name for name, group in groups.items() if all(group.values())]:
            del groups[name]
        super().remove_node(node)
        return crashed


class Turns:
    """A lock between the workers of one run: either one test that runs alone, or any number of others."""

    def __init__(self, run_id: str) -> None:
        # A worker that waits to run alone holds the turnstile, so that no more tests of the others start before it.
        places = [Path(tempfile.gettempdir()) / f"tower-tests-{run_id}-{name}" for name in ("turnstile", "room")]
        # The kernel closes these files, and releases their locks, when the process ends in any way.
        self._turnstile, self._room = (os.open(place, os.O_RDWR | os.O_CREAT, 0o600) for place in places)
        self._places = places
        self._is_kept = False

    def enter(self, item: pytest.Item) -> None:
        if self._is_kept:
            return
        fcntl.flock(self._turnstile, fcntl.LOCK_EX)
        fcntl.flock(self._room, fcntl.LOCK_EX if _is_alone(item) else fcntl.LOCK_SH)
        fcntl.flock(self._turnstile, fcntl.LOCK_UN)

    def leave(self, item: pytest.Item, after: pytest.Item | None) -> None:
        # Waits for the others once, not for each test that runs alone.
        self._is_kept = _is_alone(item) and after is not None and _is_alone(after)
        if not self._is_kept:
            fcntl.flock(self._room, fcntl.LOCK_UN)

    def tidy_up(self) -> None:
        """Removes the lock files. Any worker may do this at its end: no test starts before all workers have opened the
        files."""
        for place in self._places:
            place.unlink(missing_ok=True)


def turns_of_this_run() -> Turns | None:
    """Returns None in a run without workers, and in the process that only distributes the work."""
    run_id = os.environ.get("PYTEST_XDIST_TESTRUNUID")
    return Turns(run_id) if run_id and "PYTEST_XDIST_WORKER" in os.environ else None


def _is_alone(item: pytest.Item) -> bool:
    return item.path.name in ALONE
