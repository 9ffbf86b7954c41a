"""Percentiles, and the shape of the JSON that programs read."""

import json
import math
from pathlib import Path

import pytest

from bench.__main__ import parse
from bench.rows import Report, percentile


@pytest.mark.parametrize(("share", "wanted"), [(0.5, 50.0), (0.95, 95.0), (0.99, 99.0), (1.0, 100.0), (0.001, 1.0)])
def test_percentiles_are_values_that_occurred(share: float, wanted: float) -> None:
    assert percentile([float(number) for number in range(100, 0, -1)], share) == wanted


def test_few_values_have_their_greatest_as_the_95th() -> None:
    assert percentile([3.0, 1.0, 2.0], 0.95) == 3.0
    assert math.isnan(percentile([], 0.5))


def test_the_json_has_the_agreed_shape(tmp_path: Path) -> None:
    report = Report("control")
    report.spread("take, loopback", "request_to_confirmed", [10.0, 20.0], "ms")
    report.add("take, loopback", "level_after", math.nan, "s")
    report.write(tmp_path / "out.json")
    found = json.loads((tmp_path / "out.json").read_text())
    assert found["bench"] == "control"
    assert found["machine"]["cpus"]
    for row in found["rows"]:
        assert set(row) == {"case", "system", "metric", "value", "unit"}
    assert found["rows"][0] == {
        "case": "take, loopback",
        "system": "ours",
        "metric": "request_to_confirmed_p50",
        "value": 10.0,
        "unit": "ms",
    }
    assert found["rows"][-1]["value"] is None


def test_the_table_has_percentiles_side_by_side() -> None:
    report = Report("control")
    report.spread("take", "request_to_confirmed", [10.0, 20.0], "ms")
    report.add("take", "level_after", 0.4, "s")
    table = report.as_table()
    assert table.row_count == 2


def test_the_command_line_knows_its_benches() -> None:
    options = parse(["control", "--quick", "--flavour", "px4", "--case", "take"])
    assert (options.name, options.quick, options.flavour, options.case) == ("control", True, ["px4"], ["take"])
    with pytest.raises(SystemExit):
        parse(["nonsense"])
