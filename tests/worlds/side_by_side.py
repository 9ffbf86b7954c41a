"""How tests share a machine with each other when several workers run them (`pytest -n 3`, as `make test` does).

A module's tests stay together, so that what they share is made once. All browser tests are one group: two browsers that
draw in software never run at once. A module that measures short times has the machine to itself.
"""

import fcntl
import os
import tempfile
from pathlib import Path
from typing import Any, Final

import pytest
from xdist.scheduler.loadscope import LoadScopeScheduling

ALONE: Final = ("test_bench_network.py", "test_attacks_beside_a_flight.py", "test_tenants_beside_a_flight.py")
"""What these measure would be spoilt by tests beside them: while one of them runs, no other test does."""

LONGEST_FIRST: Final = (
    "test_connect_stock_clients.py",
    "test_bench_relay.py",
    "test_connect.py",
    "test_chaos.py",
    "test_bench_control.py",
    "test_bench_missions.py",
    "test_plans_round_trip.py",
    "test_video_chain.py",
    "test_whole_way.py",
)
"""Modules that take long. Begun early, they do not make everybody wait at the end."""

BROWSER: Final = "browser"


def group_of(path: Path) -> str:
    """Tests of one group run one after the other, in one worker."""
    return BROWSER if "e2e" in path.parts else str(path)


def rank_of(item: pytest.Item) -> int:
    """Smaller ones begin earlier: what nobody may be beside, the longest, and what is over in no time last."""
    order = (*ALONE, BROWSER, *LONGEST_FIRST)
    key = Path(group_of(item.path)).name
    return order.index(key) if key in order else len(order) + ("unit" in item.path.parts)


class Groups(LoadScopeScheduling):  # type: ignore[misc]
    """Hands whole groups to workers, in the order of the collection."""

    def __init__(self, config: pytest.Config, log: Any) -> None:
        config.option.loadscopereorder = False
        super().__init__(config, log)

    def _split_scope(self, nodeid: str) -> str:
        return group_of(Path(nodeid.split("::")[0]))


class Turns:
    """Between the workers of one run: either one test that is alone, or any number of others."""

    def __init__(self, run_id: str) -> None:
        # Whoever waits to be alone holds the turnstile, so that no more others go in before.
        places = [Path(tempfile.gettempdir()) / f"tower-tests-{run_id}-{name}" for name in ("turnstile", "room")]
        # Closed, and with that let go, when the process ends, however it ends.
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
        # One wait for the others, not one for each test that wants to be alone.
        self._is_kept = _is_alone(item) and after is not None and _is_alone(after)
        if not self._is_kept:
            fcntl.flock(self._room, fcntl.LOCK_UN)

    def tidy_up(self) -> None:
        """Leaves no file behind. Nobody begins before all have opened them, so any worker's end will do."""
        for place in self._places:
            place.unlink(missing_ok=True)


def turns_of_this_run() -> Turns | None:
    """None where nobody else is: a run without workers, and the process that only hands out the work."""
    run_id = os.environ.get("PYTEST_XDIST_TESTRUNUID")
    return Turns(run_id) if run_id and "PYTEST_XDIST_WORKER" in os.environ else None


def _is_alone(item: pytest.Item) -> bool:
    return item.path.name in ALONE
