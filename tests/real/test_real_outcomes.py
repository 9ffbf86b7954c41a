"""A real ArduCopter: no offered mode lands untold, and no injected failure stays untold."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from bench import failures, modes
from bench.rows import Report


async def figures(work: object, name: str, program: Path, tmp_path: Path, drones: int) -> dict[tuple[str, str], float]:
    report = Report(name)
    options = Namespace(autopilot=program, cases=None, drones=drones, keep=tmp_path / name)
    await work.run(report, options)  # type: ignore[attr-defined]
    return {(row.case, row.metric): row.value for row in report.rows}


async def test_a_minute_without_sticks_in_every_offered_mode(arducopter: Path, tmp_path: Path) -> None:
    found = await figures(modes, "modes", arducopter, tmp_path, 4)
    for mode in modes.OFFERED:
        assert (mode.name, "failed") not in found
        assert found[mode.name, "untold"] == 0
    landed = {case for case, metric in found if metric == "ground_after"}
    assert landed <= {"RTL", "SMART_RTL", "LAND"}, "no other mode ends on the ground within a minute"


async def test_every_failure_is_told(arducopter: Path, tmp_path: Path) -> None:
    found = await figures(failures, "failures", arducopter, tmp_path, 4)
    for failure in failures.FAILURES:
        assert (failure.name, "failed") not in found
        assert found[failure.name, "untold"] == 0, failure.name
