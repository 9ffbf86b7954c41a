"""The log of a flight: one line each half second, a rising index, and a picture of it; and of logs of other formats."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from simulator import dataflash
from simulator.control.trajectory import plan
from simulator.dataflash import Kind
from simulator.firmware.command_line import app
from simulator.firmware.controller import Fleet, FleetSettings
from simulator.firmware.flight_csv import FlightCsv
from simulator.flight_log import COLUMNS, HEADER, CsvLines, NotALog, read
from simulator.modes import Mode
from simulator.plots.dataflash_columns import columns_of
from simulator.plots.flight_plot import flight_picture
from simulator.vehicle_csv import FlightLogs

STEPS = 250


def logged(period_s: float = 0.5) -> str:
    fleet = Fleet(FleetSettings(dt_s=0.02))
    fleet.boot()
    fleet.arm()
    log, up, began_s = FlightCsv(period_s=period_s), plan([], take_off_m=5.0, land=False), fleet.now_s
    lines = [HEADER]
    for _ in range(STEPS):
        fleet.step(up.at(fleet.now_s - began_s))
        lines.append(log.note(fleet))
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
    words, lines = drawn(flight_picture(read(logged())))
    assert {"truth", "estimate", "Height", "Roll and pitch"} <= words
    assert len(lines) == 2 + 2 + 4 + 3 + 1 + 4


def drawn(picture: str) -> tuple[set[str | None], list[str]]:
    """Returns the words and the lines of a picture."""
    tree = ElementTree.fromstring(picture)
    lines = [line.attrib["points"] for line in tree.iter("{http://www.w3.org/2000/svg}polyline")]
    assert lines
    assert all(line and "nan" not in line for line in lines)
    return {element.text for element in tree.iter("{http://www.w3.org/2000/svg}text")}, lines


def test_the_time_of_a_log_rises_over_a_restart() -> None:
    lines = CsvLines(0.5)
    numbers = [0.0] * (len(COLUMNS) - 3)
    seen = [lines.line(now_s, "", numbers) for now_s in (3.0, 3.2, 3.5, 0.1, 0.4, 0.6) if lines.due(now_s)]
    assert [line.split(",")[:2] for line in seen] == [["1", "3.000"], ["2", "3.500"], ["3", "3.600"], ["4", "4.100"]]


def test_each_vehicle_of_tower_sim_writes_a_log_that_can_be_drawn(ground: Any, tmp_path: Path) -> None:
    station = ground()
    logs = FlightLogs(tmp_path / "logs", [station.vehicle])
    station.ready()
    station.set_mode(Mode.GUIDED)
    station.command(400, 1)
    station.command(22, 0, 0, 0, 0, 0, 0, 5)
    for _ in range(400):
        station.run(0.02)
        logs.step()
    logs.close()
    log, picture = tmp_path / "logs" / "vehicle-1.csv", tmp_path / "picture.svg"
    columns = read(log.read_text())
    assert columns["alt_m"][-1] == columns["estimate_alt_m"][-1] == pytest.approx(5.0, abs=0.5)
    assert 0.3 < columns["motor_1"][-1] < 0.9
    assert CliRunner().invoke(app, ["plot", str(log), str(picture)]).exit_code == 0
    assert len(drawn(picture.read_text())[1]) == 16


def onboard_log(ground: Any) -> bytes:
    station = ground().take_off()
    station.run(3.0)
    return bytes(station.vehicle._logbook.logs[0].data)


def test_a_log_on_board_is_drawn_without_a_truth_that_it_does_not_have(ground: Any, tmp_path: Path) -> None:
    log, picture = tmp_path / "1.bin", tmp_path / "picture.svg"
    log.write_bytes(onboard_log(ground))
    assert columns_of(log.read_bytes())["estimate_alt_m"][-1] == pytest.approx(10.0, abs=0.5)
    assert CliRunner().invoke(app, ["plot", str(log), str(picture)]).exit_code == 0
    words, lines = drawn(picture.read_text())
    assert "truth" not in words
    assert len(lines) == 1 + 1 + 2 + 1


def test_truth_and_outputs_of_ardupilots_own_simulator_are_drawn(ground: Any) -> None:
    data = onboard_log(ground)
    sim = Kind(200, "SIM", "QccCfLL", "TimeUS,Roll,Pitch,Yaw,Alt,Lat,Lng")
    out = Kind(201, "RCOU", "QHHHHa", "TimeUS,C1,C2,C3,C4,Unread")
    data += sim.described() + out_format(out)
    for second in range(2):
        data += sim.record(second * 10**7, 100, -200, 35900 - 35800 * second, 498.0, 473_977_420, 85_455_940)
        data += out_record(out, second * 10**7)
    columns = columns_of(data)
    assert columns["alt_m"][-1] == pytest.approx(10.0, abs=0.1)
    assert columns["roll_deg"][-1] == pytest.approx(1.0)
    assert min(columns["yaw_deg"]) > 358.0, "from 359 to 1 is two degrees, not 358"
    assert columns["motor_3"][-1] == pytest.approx(0.75)
    assert math.hypot(columns["north_m"][0], columns["east_m"][0]) < 1.0
    words, lines = drawn(flight_picture(columns))
    assert "truth" in words
    assert len(lines) == 16


def out_format(kind: Kind) -> bytes:
    """Of a type with an array, which this product does not write."""
    fields = (kind.number, 3 + 8 + 4 * 2 + 64, kind.name.encode(), kind.letters.encode(), kind.labels.encode())
    return dataflash.FMT.record(*fields)


def out_record(kind: Kind, time_us: int) -> bytes:
    pulses = b"".join(pulse.to_bytes(2, "little") for pulse in (1500, 1600, 1750, 1400))
    return dataflash.HEAD + bytes((kind.number,)) + time_us.to_bytes(8, "little") + pulses + bytes(64)


@given(st.binary(max_size=400), st.integers(0, 2000))
def test_any_bytes_are_a_log_or_refused(noise: bytes, at: int) -> None:
    whole = b"".join(kind.described() for kind in (*dataflash.KINDS, dataflash.FMT))
    records = [dataflash.ATT.record(i * 10**6, i, -i, 100) for i in range(20)]
    data = whole + b"".join(records)
    for damaged in (noise, data[:at] + noise + data[at:], data[:at] + noise):
        try:
            columns = columns_of(damaged)
        except NotALog:
            continue
        assert len({len(column) for column in columns.values()}) == 1
