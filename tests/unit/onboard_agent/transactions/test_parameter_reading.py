"""Parameters are read from the autopilot: losses, gaps, changes meanwhile, narrow lines."""

from __future__ import annotations

from random import Random

import pytest
from handler_line import ARDUPILOT, PX4
from hypothesis import given, settings
from hypothesis import strategies as st
from parameter_reading_line import complete, parameter_line, table_of, tables
from worlds.tiers import examples

from onboard_agent.transactions.parameter_frames import FAST, NARROW
from onboard_agent.transactions.parameter_handler import AGAIN_AFTER_S
from onboard_agent.transactions.parameter_listing import SETTLE_S
from simulator.dialect import Message, mavlink
from simulator.parameters import Kind, Parameter
from wire.parameters import table_hash
from wire.transactions import (
    Outcome,
    ParameterCache,
    ParameterChanged,
    ParametersReadWork,
    ParameterTable,
    TransactionProgress,
)


@pytest.mark.parametrize("kind", [ARDUPILOT, PX4], ids=["ardupilot", "px4"])
def test_all_are_read_in_the_time_that_the_autopilot_takes_to_list_them(kind: int) -> None:
    line = parameter_line(kind, total_count=1400)
    took_s = line.until(lambda: complete(line))
    assert FAST.list_after_s < took_s < FAST.list_after_s + 0.72
    assert line.do(ParametersReadWork()).outcome is Outcome.DONE
    assert tables(line) == [table_of(line)]
    assert line.reported(ParameterTable)[0].hash == line.reported(ParameterCache)[-1].hash == table_hash(table_of(line))
    assert line.passed_up == []
    progress = [(one.count, one.total) for one in line.reported(ParameterCache)[:-1]]
    assert 1 <= len(progress) <= 3
    assert all(0 < done < total == 1400 for done, total in progress)


def test_every_seventh_value_is_missing_and_asked_for_by_its_number() -> None:
    line = parameter_line()
    line.server.server.drop_every_seventh = True
    took_s = line.until(lambda: complete(line))
    assert took_s < FAST.list_after_s + 2.5
    assert line.sent_count("PARAM_REQUEST_LIST") == 1
    assert line.sent_count("PARAM_REQUEST_READ") == 1390 // 7
    line.do(ParametersReadWork())
    assert tables(line) == [table_of(line)]


def test_with_the_last_number_told_nothing_is_waited_for() -> None:
    line = parameter_line()
    line.to_agent = lambda number, _message: () if number == 700 else (0.0,)
    assert line.until(lambda: complete(line)) < FAST.list_after_s + 0.75
    assert line.sent_count("PARAM_REQUEST_READ") == 1


def test_what_a_gimbal_says_is_about_the_gimbal() -> None:
    line = parameter_line()
    line.until(lambda: complete(line))
    line.reports.clear()
    line.gimbal_says(mavlink.MAVLink_param_value_message(b"RTL_ALT", 7.0, 6, 20, 3))
    line.run(1.0)
    assert line.reports == []


@settings(max_examples=examples(12, long=50), deadline=None)
@given(seed=st.integers(0, 1 << 32), kind=st.sampled_from([ARDUPILOT, PX4]))
def test_whatever_is_lost_doubled_and_overtaken_the_table_is_whole(seed: int, kind: int) -> None:
    random = Random(seed)
    line = parameter_line(kind, total_count=120 if kind == PX4 else 0)
    line.server.parameters._ordered[150:] = []

    def fault(_number: int, _message: Message) -> tuple[float, ...]:
        return tuple(random.random() * 0.05 for _ in range(random.choice((0, 1, 1, 1, 1, 2))))

    line.to_agent = line.to_server = fault
    line.until(lambda: complete(line), 120)
    line.to_agent = line.to_server = lambda _number, _message: (0.0,)
    line.do(ParametersReadWork())
    assert tables(line) == [table_of(line)]


def test_their_number_changes_in_the_middle_and_the_list_begins_anew() -> None:
    line = parameter_line()
    line.until(lambda: line.reported(ParameterCache))
    ordered = line.server.parameters._ordered
    ordered.insert(0, Parameter("AAA_NEW", Kind.FLOAT, 1.5, 0))
    for index, parameter in enumerate(ordered):
        parameter.index = index
    assert line.until(lambda: line.sent_count("PARAM_REQUEST_LIST") == 2) >= SETTLE_S
    line.until(lambda: complete(line))
    line.do(ParametersReadWork())
    assert tables(line) == [table_of(line)]
    assert line.sent_count("PARAM_REQUEST_LIST") == 2


def test_they_move_while_they_are_read_and_their_number_stays() -> None:
    line = parameter_line()
    line.until(lambda: line.reported(ParameterCache))
    ordered = line.server.parameters._ordered
    gone = ordered.pop()
    ordered.insert(0, Parameter("AAA_NEW", Kind.FLOAT, 1.5, 0))
    line.until(lambda: complete(line))
    line.do(ParametersReadWork())
    names = {row.name for row in tables(line)[0]}
    assert "AAA_NEW" in names
    assert gone.name not in names


def test_a_number_that_never_rests_is_a_failure_in_words_and_tried_again() -> None:
    line = parameter_line()
    count = 0

    def another(_number: int, message: Message) -> tuple[float, ...]:
        nonlocal count
        count += 1
        message.param_count += count % 2
        return (0.0,)

    line.to_agent = another
    result = line.do(ParametersReadWork())
    assert (result.outcome, "change faster" in result.words) == (Outcome.FAILED, True)
    line.to_agent = lambda _number, _message: (0.0,)
    assert line.until(lambda: complete(line)) == pytest.approx(AGAIN_AFTER_S + 0.7, abs=0.2)


def test_names_without_a_zero_behind_values_that_are_none_and_names_that_no_table_can_hold() -> None:
    line = parameter_line()
    line.server.parameters._ordered[3:] = [
        Parameter("SIXTEEN_LETTERS_", Kind.FLOAT, 2.5, 3),
        Parameter("NO_NUMBER", Kind.FLOAT, float("nan"), 4),
        Parameter("WITH BLANK", Kind.FLOAT, 1.0, 5),
    ]
    line.until(lambda: complete(line))
    line.do(ParametersReadWork())
    assert [row.name for row in tables(line)[0]] == [
        "FORMAT_VERSION",
        "SIXTEEN_LETTERS_",
        "SYSID_MYGCS",
        "SYSID_THISMAV",
    ]


def test_one_number_is_never_told() -> None:
    line = parameter_line()
    line.to_agent = lambda _number, message: () if message.param_index == 700 else (0.0,)
    result = line.do(ParametersReadWork())
    assert result.outcome is Outcome.FAILED
    assert result.words == "The parameters could not be read: the autopilot does not report 1 of its 1390 parameters."
    assert not complete(line)


def test_an_autopilot_that_says_nothing_is_asked_five_times_and_again_later() -> None:
    line = parameter_line()
    line.server.deaf = True
    result = line.do(ParametersReadWork())
    assert result.words == "The parameters could not be read: the autopilot does not answer."
    assert line.sent_count("PARAM_REQUEST_LIST") == 5
    line.server.deaf = False
    line.until(lambda: complete(line), AGAIN_AFTER_S + 1.0)


def test_the_first_request_is_lost() -> None:
    line = parameter_line()
    line.to_server = lambda number, _message: () if number == 1 else (0.0,)
    assert line.until(lambda: complete(line)) < FAST.list_after_s + 1.5 + 0.8


def test_every_value_that_passes_counts_whoever_asked() -> None:
    line = parameter_line()
    line.until(lambda: complete(line))
    line.reports.clear()
    before = table_hash(table_of(line))
    line.server.server.set("RTL_ALT", 2500.0, 6)
    line.server.server.set("RTL_ALT", 2600.0, 6)
    line.server.server.read("RTL_SPEED", -1)
    line.run(0.6)
    assert line.reports == [
        ParameterChanged(name="RTL_ALT", value=2600.0, kind=6, before=before, hash=table_hash(table_of(line)))
    ]
    assert [message.param_id for message in line.passed_up] == ["RTL_ALT", "RTL_ALT", "RTL_SPEED"]


def test_few_changes_are_a_chain_of_hashes_and_many_are_another_table() -> None:
    line = parameter_line()
    line.until(lambda: complete(line))
    line.run(1.0)
    line.reports.clear()
    hash_before = table_hash(table_of(line))
    for name in ("RTL_ALT", "ANGLE_MAX", "LAND_SPEED"):
        line.server.server.set(name, 77.0, 4)
    line.run(0.6)
    chain = line.reported(ParameterChanged)
    assert [one.name for one in chain] == ["RTL_ALT", "ANGLE_MAX", "LAND_SPEED"]
    assert [one.before for one in chain] == [hash_before, *(one.hash for one in chain[:-1])]
    assert chain[-1].hash == table_hash(table_of(line))
    line.reports.clear()
    for number in range(1, 7):
        line.server.server.set(f"FLTMODE{number}", 11.0, 2)
    for number in range(1, 7):
        line.server.server.set(f"RC{number}_TRIM", 1499.0, 4)
    line.run(0.6)
    assert line.reports == [ParameterCache(hash=table_hash(table_of(line)), count=1390, total=1390)]
    line.run(5.0)
    assert len(line.reports) == 1


def test_a_new_tower_is_told_how_it_is() -> None:
    line = parameter_line()
    line.until(lambda: complete(line))
    line.run(1.0)
    line.reports.clear()
    line.handler.resend()
    line.run(0.1)
    assert line.reports == [ParameterCache(hash=table_hash(table_of(line)), count=1390, total=1390)]


def test_more_of_them_appear_later_and_are_read() -> None:
    line = parameter_line()
    line.until(lambda: complete(line))
    ordered = line.server.parameters._ordered
    new = Parameter("FENCE_NEW", Kind.FLOAT, 5.0, len(ordered))
    ordered.append(new)
    line.server.server.set("RTL_ALT", 2500.0, 6)
    line.run(3.0)
    assert line.sent_count("PARAM_REQUEST_LIST") == 1  # it has just been read
    line.run(AGAIN_AFTER_S)
    assert line.sent_count("PARAM_REQUEST_LIST") == 2
    line.do(ParametersReadWork())
    assert tables(line) == [table_of(line)]


def test_on_a_narrow_line_nothing_is_asked_for_while_it_is_flown_by_hand() -> None:
    line = parameter_line(narrow_line=True, flown_by_hand=True)
    line.run(NARROW.list_after_s + 5.0)
    assert line.sent == []
    result = line.do(ParametersReadWork(again=True))
    assert (result.outcome, "by hand" in result.words) == (Outcome.REFUSED, True)
    line.around_options["flown_by_hand"] = False
    line.server.server.drop_every_seventh = True
    line.until(lambda: line.sent_count("PARAM_REQUEST_READ") > 10)
    line.around_options["flown_by_hand"] = True
    asked = len(line.sent)
    line.run(5.0)
    assert len(line.sent) == asked
    line.around_options["flown_by_hand"] = False
    line.until(lambda: complete(line))
    line.do(ParametersReadWork())
    assert tables(line) == [table_of(line)]


def test_on_a_narrow_line_in_the_air_a_table_that_is_known_will_do_unless_somebody_asks() -> None:
    line = parameter_line(narrow_line=True)
    line.until(lambda: complete(line))
    line.around_options["armed"] = True
    line.comes()  # it was silent for a moment
    line.run(NARROW.list_after_s + 5.0)
    assert line.sent_count("PARAM_REQUEST_LIST") == 1
    assert line.reported(ParameterCache)[-1].verified is False
    assert line.do(ParametersReadWork(again=True)).outcome is Outcome.DONE
    line.comes()
    line.run(NARROW.list_after_s + 5.0)
    line.around_options["armed"] = False
    line.until(lambda: line.sent_count("PARAM_REQUEST_LIST") == 3)


def test_a_reading_can_be_cancelled_times_out_and_is_shared() -> None:
    line = parameter_line()
    line.server.deaf = True
    first, second = line.begin(ParametersReadWork()), line.begin(ParametersReadWork(), deadline_s=0.5)
    third = line.begin(ParametersReadWork())
    assert line.result(second).outcome is Outcome.TIMED_OUT
    line.handler.cancel(first, line.now)
    assert line.result(first).outcome is Outcome.CANCELLED
    line.server.deaf = False
    assert line.result(third).outcome is Outcome.DONE
    assert len(tables(line)) == 1
    progress = [one for one in line.reported(TransactionProgress) if one.id == third]
    assert progress
    assert progress[-1].phase == "reading"
    assert line.sent_count("PARAM_REQUEST_LIST") <= 2
    again = line.do(ParametersReadWork(again=True))
    assert again.outcome is Outcome.DONE
    assert len(tables(line)) == 1, "it is the table that was sent"


def test_a_tower_that_has_the_table_by_its_changes_is_not_sent_it_again() -> None:
    line = parameter_line()
    line.until(lambda: complete(line))
    line.do(ParametersReadWork())
    assert tables(line) == [table_of(line)]
    line.run(1.0)
    line.server.parameters.set("RTL_ALT", 2500.0)  # changed by itself, as a flight counter does: not reported
    assert line.do(ParametersReadWork(again=True)).outcome is Outcome.DONE
    assert [one.name for one in line.reported(ParameterChanged)] == ["RTL_ALT"]
    assert line.reported(ParameterChanged)[-1].hash == table_hash(table_of(line))
    assert len(tables(line)) == 1
    for number in range(6):
        line.server.parameters.set(f"RC{number + 1}_MIN", 1_050.0)
    line.run(1.0)
    assert line.do(ParametersReadWork(again=True)).outcome is Outcome.DONE
    assert tables(line)[1:] == [table_of(line)], "many changes are another table"
