"""The plans of `bench missions` are correct, and its rows report the results."""

import json
from pathlib import Path

import pytest

from bench.missions_figures import Figures
from bench.missions_plan import survey
from bench.namespaces import Carried
from bench.rows import Report
from wire.plans import plan_from_json, plan_to_json


@pytest.mark.parametrize("items", [2, 3, 20, 200])
def test_a_survey_is_a_plan_of_so_many_items_bit_for_bit(items: int) -> None:
    rows = survey(items, 7)
    plan = plan_from_json(json.dumps(rows))
    assert len(plan) == items
    assert json.loads(plan_to_json(plan)) == rows


def test_no_two_numbers_are_the_same_plan() -> None:
    assert len({json.dumps(survey(20, number)) for number in range(2000)}) == 2000


def test_the_rows_have_both_systems_their_ratio_failures_and_what_was_lost(tmp_path: Path) -> None:
    report = Report("missions")
    figures = Figures(report)
    for ours, theirs in ((1.0, 30.0), (2.0, 50.0), (1.0, 40.0)):
        figures.took("ours", "upload", ours)
        figures.took("MAVSDK", "upload", theirs)
    figures.took("ours", "upload, far", 4.0)
    figures.failed("MAVSDK", "upload", "timeout")
    figures.carried["ours", "upload"] = [Carried(90, 10, 40, 0), Carried(70, 10, 20, 2)]
    figures.announce("somewhere")
    found = {(row.case, row.system, row.metric): row.value for row in report.rows}
    case = "upload, somewhere"
    assert found[case, "ours", "took_p50"] == 1.0 and found[case, "ours", "took_max"] == 2.0
    assert found[case, "MAVSDK", "took_n"] == 3 and found[case, "MAVSDK", "failed"] == 1
    assert found[case, "ours", "times as fast as MAVSDK, medians"] == 40.0
    assert found[case, "ours", "times as fast as MAVSDK, our worst to its best"] == 15.0
    assert found["upload, far, somewhere", "ours", "times as fast as MAVSDK, medians"] == 10.0
    assert found[case, "ours", "packets from the drone, a round"] == 90.0
    assert found[case, "ours", "of those lost"] == 1.0
    report.write(tmp_path / "rows.json")
