"""Runs the scale benchmark: a small fleet, two browsers, a second of flight, on a separate tower process."""

import json
from pathlib import Path

import pytest

from bench.__main__ import parse
from bench.rows import Report
from bench.scale import run

pytestmark = pytest.mark.long("shows only that a benchmark still runs")


async def test_a_small_fleet_is_watched_without_a_loss(tmp_path: Path) -> None:
    report = Report("scale")
    await run(report, parse(["scale", "--drones", "12", "--browsers", "2", "--seconds", "1.5"]))
    file = tmp_path / "rows.json"
    report.write(file)
    found = {row["metric"]: row["value"] for row in json.loads(file.read_text())["rows"]}
    assert found["events sent"] > 0
    assert found["events lost, of all browsers together"] == 0
    assert found["events out of order"] == 0
    assert found["browsers that were told of a loss"] == 0
    assert found["age of state as it arrives_n"] > 0
    assert found["tower's memory, last"] > 0
    assert found["sign-in: all online"] > 0
