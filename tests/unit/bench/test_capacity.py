"""The model of capacity: it fits what it was fitted to, predicts what it was not, and grows with the fleet."""

import pytest

from bench.__main__ import parse
from bench.capacity import FITTED, HELD_OUT, fitted, least_squares, run
from bench.rows import Report


def test_least_squares_finds_the_constants_of_exact_points() -> None:
    rows = [(1.0, float(x), float(x * x * 1000)) for x in range(5)]
    found = least_squares(rows, [2 + 3 * b + 0.5 * c for _, b, c in rows])
    assert found == pytest.approx([2, 3, 0.5])


def test_the_model_predicts_a_run_that_it_was_not_fitted_to() -> None:
    model = fitted()
    for point in HELD_OUT:
        assert point not in FITTED
        assert model.processor_ms(point) == pytest.approx(point.processor_ms_per_s, rel=0.25)
        assert model.memory_mb(point) == pytest.approx(point.memory_mb, rel=0.1)


async def test_more_drones_need_more_towers() -> None:
    report = Report("capacity")
    await run(report, parse(["capacity", "--drones", "20000"]))
    towers = {row.case: row.value for row in report.rows if row.metric.startswith("towers")}
    assert towers["club"] == 1
    assert towers["5,000 drones"] < towers["20,000 drones"] < towers["100,000 drones"]
