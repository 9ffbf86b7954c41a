"""Runs the recorder benchmark: a small fleet through two towers, and two kills of a third."""

import json
from pathlib import Path

import pytest

from bench.__main__ import parse
from bench.recorder import run
from bench.rows import Report

pytestmark = pytest.mark.long("shows only that a benchmark still runs")


async def test_recording_takes_every_frame_and_a_kill_costs_less_than_a_second(tmp_path: Path) -> None:
    report = Report("recorder")
    await run(report, parse(["recorder", "--drones", "5", "--rounds", "1", "--seconds", "1", "--kills", "2"]))
    file = tmp_path / "rows.json"
    report.write(file)
    rows = json.loads(file.read_text())["rows"]
    found = {row["metric"]: row["value"] for row in rows if row["system"] in ("recording", "ours")}
    assert found["frames sent"] == found["frames that the tower took"] == found["frames in the files"] > 0
    assert found["age of a frame of the watched drone_n"] > 0
    assert found["flights"] == 10
    assert found["files that cannot be read to their end"] == 0
    assert found["frames missing in the middle"] == 0
    assert found["lost before the kill_max"] < 1000
