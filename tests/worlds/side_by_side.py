"""How parallel test workers share a machine (`pytest -n 3`, as `make test` does).

A module's tests stay together, so that their fixtures are made once. All browser tests are one group: two browsers that
draw in software never run at once. A module that measures short times has the machine to itself.
"""

import fcntl
import os
import tempfile
from pathlib import Path
from typing import Any, Final

import pytest
from xdist.scheduler.loadscope import LoadScopeScheduling

ALONE: Final = (
    "test_bench_network.py",
    "test_attacks_beside_a_flight.py",
    "test_tenants_beside_a_flight.py",
    "test_flight_bar.py",
    "test_controllers_flown.py",
    "test_challenge_flown.py",
)
"""Modules whose measurements parallel tests would spoil: while one of them runs, no other test does."""

LONGEST_FIRST: Final = (
    "test_bench_relay.py",
    "test_plans_round_trip.py",
    "test_bench_faults.py",
    "test_routes_without_database.py",
    "test_one_tower.py",
    "test_several_towers_filmed.py",
    "test_make_run.py",
    "test_openapi_contract.py",
    "test_bench_missions.py",
    "test_statistics_flown.py",
    "test_bench_recorder.py",
    "test_every_command.py",
    "test_bench_control.py",
    "test_packages.py",
    "test_server_cli.py",
    "test_ports_flown.py",
    "test_video_chain.py",
    "test_follow_me_flown.py",
    "test_backup.py",
    "test_precision_landing.py",
    "test_separation_flown.py",
    "test_connect_stock_clients.py",
    "test_server_control_safety.py",
    "test_agent_video.py",
    "test_connect.py",
    "test_chaos.py",
    "test_work_flown.py",
    "test_agent_plans.py",
    "test_loan_limits_flown.py",
    "test_connect_ground_station.py",
    "test_several_towers_flown.py",
)
"""Modules that take long. They start early, so that they do not delay the end of the run."""

BROWSER: Final = "browser"


def group_of(path: Path) -> str:
    """Returns the group of a module. Tests of one group run one after the other in one worker."""
    return BROWSER if "e2e" in path.parts else str(path)


def rank_of(item: pytest.Item) -> int:
    """Returns the start order: first the tests that run alone, then the longest, and the unit tests last."""
    order = (*ALONE, BROWSER, *LONGEST_FIRST)
    key = Path(group_of(item.path)).name
    return order.index(key) if key in order else len(order) + ("unit" in item.path.parts)


class Groups(LoadScopeScheduling):  # type: ignore[misc]
    """Gives whole groups to workers, in the order of the collection."""

    def __init__(self, config: pytest.Config, log: Any) -> None:
        config.option.loadscopereorder = False
        super().__init__(config, log)

    def _split_scope(self, nodeid: str) -> str:
        return group_of(Path(nodeid.split("::")[0]))

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
