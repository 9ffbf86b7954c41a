"""A log never overwrites another one."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from simulator.control.figure_of_eight import FigureOfEight
from simulator.control.trajectory import TrajectoryRefused
from simulator.firmware.command_line import app
from simulator.flight_log import open_new


def test_the_next_free_number_is_taken(tmp_path: Path) -> None:
    for text in ("one", "two", "three"):
        with open_new(tmp_path / "flight.csv") as file:
            file.write(text)
    names = ("flight.csv", "flight-2.csv", "flight-3.csv")
    assert [(tmp_path / name).read_text() for name in names] == ["one", "two", "three"]


def test_a_second_flight_leaves_the_log_of_the_first(tmp_path: Path) -> None:
    log = tmp_path / "flight.csv"
    said = []
    for seconds in ("1", "2"):
        ran = CliRunner().invoke(app, ["fly", "eight", "--log", str(log), "--seconds", seconds])
        assert ran.exit_code == 0, ran.output
        said.append(ran.output)
    assert str(tmp_path / "flight-2.csv") in said[1]
    assert len((tmp_path / "flight-2.csv").read_text()) > len(log.read_text())


@pytest.mark.parametrize("rounds", [0, -1])
def test_an_eight_is_flown_once_or_more(rounds: int) -> None:
    with pytest.raises(TrajectoryRefused, match="1 time or more"):
        FigureOfEight(8.0, 14.0, 10.0, rounds=rounds)
