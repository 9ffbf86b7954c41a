"""The log of a flight: one line each half second, a rising index, and a picture of it."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from simulator.control.trajectory import plan
from simulator.firmware.controller import Fleet, FleetSettings
from simulator.firmware.flight_csv import COLUMNS, FlightCsv, NotALog, read
from simulator.plots.flight_plot import flight_picture

STEPS = 250


def logged(period_s: float = 0.5) -> str:
    fleet = Fleet(FleetSettings(dt_s=0.02))
    fleet.boot()
    fleet.arm()
    log, up, began_s = FlightCsv(fleet, period_s=period_s), plan([], take_off_m=5.0, land=False), fleet.now_s
    lines = [log.header()]
    for _ in range(STEPS):
        fleet.step(up.at(fleet.now_s - began_s))
        lines.append(log.note())
    return "".join(lines)


def test_a_log_has_a_line_each_half_second_and_a_rising_index() -> None:
    columns = read(logged())
    assert len(columns["index"]) == pytest.approx(10, abs=1)
    assert columns["time_s"][2] - columns["time_s"][1] == pytest.approx(0.5)
    assert columns["alt_m"][-1] > 3.0
    assert columns["estimate_alt_m"][-1] == pytest.approx(columns["alt_m"][-1], abs=0.5)
    assert len(read(logged(period_s=0.0))["index"]) == STEPS, "at full rate: every step"


def test_what_is_not_a_whole_log_is_refused() -> None:
    text = logged()
    lines = text.splitlines(keepends=True)
    damaged = text.replace("SYS_RUN_AUTO,0", "SYS_RUN_AUTO,x", 1)
    for bad in ("", "a,b\n1,2\n", "".join(lines[:3] + lines[4:]), damaged):
        with pytest.raises(NotALog):
            read(bad)
    assert lines[0].count(",") == len(COLUMNS) - 1


def test_the_picture_shows_estimate_and_truth() -> None:
    picture = ElementTree.fromstring(flight_picture(read(logged())))
    words = {element.text for element in picture.iter("{http://www.w3.org/2000/svg}text")}
    assert {"truth", "estimate", "Height", "Roll and pitch"} <= words
    lines = list(picture.iter("{http://www.w3.org/2000/svg}polyline"))
    assert len(lines) == 2 + 2 + 4 + 3 + 1 + 4
    assert all("nan" not in line.attrib["points"] for line in lines)
