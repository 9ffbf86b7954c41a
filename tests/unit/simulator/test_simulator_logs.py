"""Logs on board: written while armed, listed and read over the link, and in a standard format."""

from __future__ import annotations

import pytest
from pymavlink.DFReader import DFReader_binary

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.logbook import LOG_BYTES_MAX, LOGS_MAX
from simulator.modes import Mode
from simulator.px4.flavour import PX4

ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM


def flown(ground, **options):
    """Flies for half a minute and lands."""
    station = ground(**options).take_off()
    station.run(10)
    station.set_mode(Mode.LAND)
    station.until(lambda: not station.flight.armed, 60)
    return station


def listed(station, start: int = 0, end: int = 0xFFFF) -> list:
    station.send(mavlink.MAVLink_log_request_list_message(1, 1, start, end))
    return [m for m in station.run(0.2) if m.get_type() == "LOG_ENTRY"]


def ask(station, number: int, offset: int, count: int, compid: int = 190) -> None:
    station.send(mavlink.MAVLink_log_request_data_message(1, 1, number, offset, count), 255, compid)


def chunks(station, seconds: float) -> list:
    return [m for m in station.run(seconds) if m.get_type() == "LOG_DATA"]


def test_with_none_on_board_a_single_entry_says_so(ground):
    station = ground().ready()
    (entry,) = listed(station)
    assert (entry.id, entry.num_logs, entry.last_log_num, entry.size) == (0, 0, 0, 0)


def test_a_flight_is_a_log_that_others_can_read(ground, tmp_path):
    station = flown(ground)
    (entry,) = listed(station)
    assert (entry.id, entry.num_logs, entry.last_log_num) == (1, 1, 1)
    assert 0 <= entry.time_utc - 1_767_225_600 < 5  # the GPS clock at switch-on, and when it was armed
    ask(station, 1, 0, 0xFFFFFFFF)
    got = chunks(station, 2)
    assert [m.ofs for m in got] == list(range(0, entry.size, 90))
    data = b"".join(bytes(m.data[: m.count]) for m in got)
    assert len(data) == entry.size
    path = tmp_path / "flight.bin"
    path.write_bytes(data)
    log, records = DFReader_binary(str(path)), []
    try:
        while (record := log.recv_msg()) is not None:
            records.append(record)
    finally:
        log.close()
    kinds = {r.get_type() for r in records}
    assert {"FMT", "PARM", "MSG", "MODE", "GPS", "ATT", "POS", "BAT"} <= kinds
    parameters = {r.Name: r.Value for r in records if r.get_type() == "PARM"}
    assert parameters["RTL_ALT"] == 1500
    assert len(parameters) == len(station.vehicle.parameters)
    assert [r.ModeNum for r in records if r.get_type() == "MODE"] == [4, 9]
    highest = max(r.RelHomeAlt for r in records if r.get_type() == "POS")
    assert highest == pytest.approx(10, abs=0.3)
    where = next(r for r in records if r.get_type() == "GPS")
    assert (where.Lat, where.Alt) == (pytest.approx(47.397742, abs=1e-4), pytest.approx(488, abs=1))
    assert "Arming motors" in [r.Message for r in records if r.get_type() == "MSG"]


@pytest.mark.parametrize(("bitmask", "a_second"), [(176126, 5), (176127, 200)])
def test_attitude_fast_logs_every_tick(ground, tmp_path, bitmask, a_second):
    station = ground(parameters={"LOG_BITMASK": bitmask})
    station.ready()
    assert station.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    station.run(4)
    path = tmp_path / "flight.bin"
    path.write_bytes(station.vehicle._logbook.logs[0].data)
    log, times_s = DFReader_binary(str(path)), []
    try:
        while (record := log.recv_match(type="ATT")) is not None:
            times_s.append(record.TimeUS * 1e-6)
    finally:
        log.close()
    assert (len(times_s) - 1) / (times_s[-1] - times_s[0]) == pytest.approx(a_second, rel=0.02)
    assert times_s[-1] - times_s[0] > 3.0


def test_a_part_and_what_is_not_there(ground):
    station = flown(ground)
    size = listed(station)[0].size
    ask(station, 1, 100, 200)
    assert [(m.ofs, m.count) for m in chunks(station, 0.1)] == [(100, 90), (190, 90), (280, 20)]
    ask(station, 1, size - 10, 90)
    assert [(m.ofs, m.count) for m in chunks(station, 0.1)] == [(size - 10, 10)]
    ask(station, 1, size, 90)
    assert [(m.ofs, m.count) for m in chunks(station, 0.1)] == [(size, 0)]
    for number in (0, 2, 65535):
        ask(station, number, 0, 90)
        assert chunks(station, 0.1) == []


def test_dropped_chunks_can_be_asked_for_again(ground):
    station = flown(ground, failures={Failure.LOG_DATA_DROPPED})
    size = listed(station)[0].size
    ask(station, 1, 0, 0xFFFFFFFF)
    got = {m.ofs for m in chunks(station, 2)}
    missing = sorted(set(range(0, size, 90)) - got)
    assert len(missing) == -(-size // 90) // 7
    ask(station, 1, missing[0], 90)
    assert [m.ofs for m in chunks(station, 0.1)] == [missing[0]]


def test_nothing_is_sent_while_it_is_armed(ground):
    station = flown(ground)
    station.set_mode(Mode.GUIDED)
    assert station.command(ARM, 1) == 0
    assert listed(station) == []
    ask(station, 1, 0, 180)
    assert chunks(station, 0.5) == []
    station.command(ARM, 0)
    station.run(0.2)
    assert len(station.of("LOG_DATA")) == 2


def test_a_download_can_be_ended_and_is_not_disturbed_by_another_client(ground):
    station = flown(ground)
    ask(station, 1, 0, 0xFFFFFFFF)
    station.run(0.02)
    ask(station, 1, 0, 90, compid=7)
    station.run(0.02)
    assert "Log download in progress" in station.texts()
    station.send(mavlink.MAVLink_log_request_end_message(1, 1))
    station.run(0.02)
    assert chunks(station, 0.5) == []
    assert 0 < len(station.of("LOG_DATA")) < 200


def test_erasing(ground):
    station = flown(ground)
    station.send(mavlink.MAVLink_log_erase_message(1, 1))
    station.run(0.1)
    assert listed(station)[0].num_logs == 0


def test_logs_outlive_a_reboot_and_the_oldest_goes(ground):
    station = ground().ready()
    station.set_mode(Mode.GUIDED)
    begun = []
    for _ in range(LOGS_MAX + 2):
        assert station.command(ARM, 1) == 0
        begun.append(round(station.now_s))
        station.run(2)
        station.command(ARM, 0)
    station.command(mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1)
    station.run(1)
    entries = listed(station)
    assert [m.id for m in entries] == list(range(1, LOGS_MAX + 1))
    assert [m.time_utc - 1_767_225_600 for m in entries] == pytest.approx(begun[2:], abs=1)
    assert [m.id for m in listed(station, 2, 3)] == [2, 3]


def test_a_log_does_not_grow_without_end(ground):
    station = ground().take_off()
    logbook = station.vehicle._logbook
    log = logbook.logs[0]
    log.data += bytes(LOG_BYTES_MAX - len(log.data) - 100)
    station.run(5)
    assert LOG_BYTES_MAX - 100 < len(log.data) <= LOG_BYTES_MAX


def test_px4_has_no_logs_of_this_kind(ground):
    station = ground(flavour=PX4).ready()
    assert [m.num_logs for m in listed(station)] == [0]
