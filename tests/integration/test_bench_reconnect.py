"""Runs the reconnect benchmark: forty browsers of as many users, a real agent, and a tower that is killed."""

import pytest

from bench.__main__ import parse
from bench.reconnect import GAP, PAUSE, run
from bench.rows import Report

pytestmark = pytest.mark.long("shows only that a benchmark still runs")


async def test_all_browsers_are_live_again_and_the_pilots_sticks_go_on() -> None:
    report = Report("reconnect")
    await run(report, parse(["reconnect", "--browsers", "40", "--drones", "6"]))
    found = {(row.case, row.metric): row.value for row in report.rows}
    assert found["restart", "until a browser is live_n"] == 40
    assert found["cut", "until a browser is live_n"] == 39
    assert found["restart", "all live after"] < 20
    assert found["cut", "all live after"] < 20
    for case in ("restart", "cut"):
        # What the machine took from the sender is not the tower's; beside other tests that can be much.
        assert found[case, GAP] - found[case, PAUSE] < 200
