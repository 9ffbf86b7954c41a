"""The parameter table and its protocol."""

from __future__ import annotations

import pytest

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.parameter_notation import rows
from simulator.parameter_table import TABLE
from simulator.parameters import Kind, Parameters


def listed(station, seconds: float = 3.0) -> list:
    station.send(mavlink.MAVLink_param_request_list_message(1, 1))
    return [m for m in station.run(seconds) if m.get_type() == "PARAM_VALUE"]


def test_the_whole_list_comes_once_in_order_after_a_banner(ground):
    station = ground().ready()
    before = len(station.heard)
    values = listed(station)
    assert [m.param_index for m in values] == list(range(len(TABLE)))
    assert {m.param_count for m in values} == {len(TABLE)}
    assert len({m.param_id for m in values}) == len(TABLE)
    texts = [m.text for _, m in station.heard[before:] if m.get_type() == "STATUSTEXT"]
    assert texts[:2] == ["ArduCopter V4.6.2 (simulated)", "Frame: QUAD/X"]
    kinds = [m.get_type() for _, m in station.heard[before:]]
    assert kinds.index("STATUSTEXT") < kinds.index("PARAM_VALUE")


def test_a_table_filled_up_is_the_same_each_time(ground):
    first, second = (listed(ground(parameter_count=1600).ready(), 5) for _ in range(2))
    assert len(first) == 1600
    assert [(m.param_id, m.param_value) for m in first] == [(m.param_id, m.param_value) for m in second]


def test_it_has_as_many_as_a_real_copter_and_a_list_takes_less_than_a_second(ground):
    assert 1350 <= len(TABLE) <= 1450
    station = ground().ready()
    assert len(listed(station, 0.9)) == len(TABLE)


def test_the_list_is_written_in_what_can_be_stored():
    """A default that its type cannot hold would change when written back to itself."""
    parameters = Parameters()
    for name, kind, value in TABLE:
        stored = parameters.set(name, value)
        assert stored is not None, name
        assert stored.value == pytest.approx(value, rel=1e-6), (name, kind)


def test_groups_that_repeat_have_each_member():
    names = {name for name, _, _ in TABLE}
    assert {f"SERVO{n}_FUNCTION" for n in range(1, 17)} <= names
    assert {f"BATT{n}_MONITOR" for n in ("", *range(2, 10))} <= names
    assert {f"EK3_SRC{n}_YAW" for n in (1, 2, 3)} <= names
    assert {"COMPASS_OFS_X", "COMPASS_OFS2_X", "COMPASS_OFS3_X", "RNGFNDA_TYPE", "ATC_RAT_YAW_FLTE"} <= names
    assert [Parameters()[f"SERVO{n}_FUNCTION"] for n in range(1, 6)] == [33, 34, 35, 36, 0]


@pytest.mark.parametrize("wrong", ["GPS_ TYPE=x1", "GPS_ TYPE", "GPS_ TYPE=b", "GPS_ TYPE=b1=2"])
def test_what_is_not_in_the_notation_is_refused(wrong):
    with pytest.raises((KeyError, ValueError, IndexError)):
        rows(wrong)


def test_names_fit_and_types_are_those_that_ardupilot_has():
    parameters = Parameters(total_count=1600)
    assert all(1 <= len(p.name) <= 16 and p.name.isascii() for p in parameters)
    assert len({p.name for p in parameters}) == 1600
    assert {int(p.kind) for p in parameters} == {2, 4, 6, 9}


def test_reading_by_name_and_by_index(ground):
    station = ground().ready()
    station.send(mavlink.MAVLink_param_request_read_message(1, 1, b"SYSID_MYGCS", -1))
    station.send(mavlink.MAVLink_param_request_read_message(1, 1, b"", 0))
    by_name, by_index = (m for m in station.run(0.1) if m.get_type() == "PARAM_VALUE")
    assert (by_name.param_id, by_name.param_value, by_name.param_index) == ("SYSID_MYGCS", 255, 65535)
    assert (by_index.param_id, by_index.param_index) == ("FORMAT_VERSION", 0)


def test_what_does_not_exist_gets_no_answer(ground):
    station = ground().ready()
    station.send(mavlink.MAVLink_param_request_read_message(1, 1, b"NO_SUCH", -1))
    station.send(mavlink.MAVLink_param_request_read_message(1, 1, b"", 9999))
    station.send(mavlink.MAVLink_param_set_message(1, 1, b"NO_SUCH", 1, 9))
    station.send(mavlink.MAVLink_param_set_message(1, 1, b"RTL_ALT", float("nan"), 6))
    assert [m for m in station.run(0.1) if m.get_type() == "PARAM_VALUE"] == []
    assert station.vehicle.parameters["RTL_ALT"] == 1500


@pytest.mark.parametrize(
    ("name", "given", "kept"),
    [
        ("RTL_ALT", 2000.0, 2000.0),
        ("RTL_ALT", 2000.6, 2001.0),
        ("FS_THR_ENABLE", 1000.0, 127.0),
        ("RC1_MIN", -99999.0, -32768.0),
        ("WPNAV_SPEED", 512.5, 512.5),
    ],
)
def test_setting_answers_with_what_is_now_stored(ground, name, given, kept):
    station = ground().ready()
    station.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), given, 9))
    value = next(m for m in station.run(0.1) if m.get_type() == "PARAM_VALUE")
    assert (value.param_id, value.param_value, value.param_index) == (name, kept, 65535)
    assert station.vehicle.parameters[name] == kept


def test_dropped_values_can_be_asked_for_one_by_one(ground):
    station = ground(failures={Failure.PARAMETERS_DROPPED}).ready()
    got = {m.param_index for m in listed(station)}
    missing = set(range(len(TABLE))) - got
    assert len(missing) == len(TABLE) // 7
    for index in missing:
        station.send(mavlink.MAVLink_param_request_read_message(1, 1, b"", index))
    got |= {m.param_index for m in station.run(0.5) if m.get_type() == "PARAM_VALUE"}
    assert got == set(range(len(TABLE)))


def test_a_locked_parameter_is_answered_with_what_it_was(ground):
    station = ground(failures={Failure.PARAMETERS_LOCKED}).ready()
    before = station.vehicle.parameters["BRD_OPTIONS"]
    station.send(mavlink.MAVLink_param_set_message(1, 1, b"BRD_OPTIONS", before + 8, 6))
    heard = station.run(0.1)
    assert [m.param_value for m in heard if m.get_type() == "PARAM_VALUE"] == [before]
    assert any("denied" in m.text for m in heard if m.get_type() == "STATUSTEXT")
    assert station.vehicle.parameters["BRD_OPTIONS"] == before


def test_a_parameter_that_does_not_exist_cannot_be_preset():
    with pytest.raises(KeyError, match="NO_SUCH"):
        Parameters([("NO_SUCH", 1.0)])
    assert Parameters([("RTL_ALT", 700)])["RTL_ALT"] == 700
    assert Parameters().find("RTL_ALT").kind is Kind.INT32


def test_the_configured_ground_station_can_be_changed(ground):
    station = ground().ready()
    station.send(mavlink.MAVLink_param_set_message(1, 1, b"SYSID_MYGCS", 77, 4))
    station.run(0.1)
    station.send(station.override(1700, 1500, 1500, 1500), 255)
    station.run(0.1)
    assert station.flight.sticks.pwm[0] == 1500
    station.send(station.override(1700, 1500, 1500, 1500), 77)
    station.run(0.1)
    assert station.flight.sticks.pwm[0] == 1700
