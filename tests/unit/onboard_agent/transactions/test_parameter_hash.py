"""PX4 reports a hash of all parameters: when it saves a read, and when it is not trusted."""

from __future__ import annotations

from handler_line import PX4
from parameter_reading_line import MemoryStore, complete, parameter_line, remembered, table_of, tables

from onboard_agent.transactions.parameter_frames import FAST
from onboard_agent.transactions.parameter_handler import SAVE_AFTER_S
from onboard_agent.transactions.parameter_listing import LONGEST_QUIETS
from simulator.dialect import Message
from wire.transactions import (
    ParameterCache,
    ParameterChanged,
    ParametersReadWork,
    ParametersWriteWork,
)

# PX4 reports a hash of all parameters.


def test_px4_with_the_hash_that_it_had_is_not_read_again() -> None:
    store = remembered(PX4)
    line = parameter_line(PX4, store=store)
    took_s = line.until(lambda: complete(line))
    assert took_s < FAST.list_after_s + 0.1
    assert [message.get_type() for message in line.sent] == ["PARAM_REQUEST_READ"]
    line.do(ParametersReadWork())
    assert tables(line) == [table_of(line)]
    line.do(ParametersReadWork(again=True))
    assert line.sent_count("PARAM_REQUEST_LIST") == 1


def test_px4_with_another_hash_is_read() -> None:
    store = remembered(PX4)
    line = parameter_line(PX4, store=store)
    line.server.parameters.set("NAV_DLL_ACT", 3.0)
    line.until(lambda: complete(line))
    line.do(ParametersReadWork())
    assert tables(line) == [table_of(line)]
    assert line.sent_count("PARAM_REQUEST_LIST") == 1


def test_px4_with_a_change_unheard_while_it_was_read_has_no_hash_for_another_time() -> None:
    store = MemoryStore()
    line = parameter_line(PX4, store=store)
    line.until(lambda: line.reported(ParameterCache))
    line.server.parameters.set("MAV_TYPE", 13.0)  # reported already, and no report of a change follows
    line.until(lambda: store.records)
    again = parameter_line(PX4, store=store)
    again.server.parameters.set("MAV_TYPE", 13.0)
    again.until(lambda: complete(again))
    assert again.sent_count("PARAM_REQUEST_LIST") == 1
    assert again.reported(ParameterChanged)[-1].name == "MAV_TYPE"


def test_px4_whose_hash_somebody_asks_for_in_the_middle_of_the_list() -> None:
    store = MemoryStore()
    line = parameter_line(PX4, store=store)
    line.until(lambda: line.reported(ParameterCache))
    line.server.parameters.set("MAV_TYPE", 13.0)
    line.server.server.read("_HASH_CHECK", -1)
    line.until(lambda: store.records)
    again = parameter_line(PX4, store=store)
    again.server.parameters.set("MAV_TYPE", 13.0)
    again.until(lambda: complete(again))
    assert again.reported(ParameterChanged)[-1].name == "MAV_TYPE"


def test_px4_that_tells_no_hash_any_more_is_read() -> None:
    store = remembered(PX4)
    line = parameter_line(PX4, store=store)
    line.server.parameters.hash_on_the_wire = lambda: None
    took_s = line.until(lambda: complete(line))
    assert took_s > FAST.list_after_s + 2 * FAST.answer_s
    line.do(ParametersReadWork())
    assert tables(line) == [table_of(line)]


def test_after_a_write_the_hash_is_not_believed() -> None:
    store = remembered(PX4)
    line = parameter_line(PX4, store=store)
    line.until(lambda: complete(line))
    line.do(ParametersWriteWork((("NAV_DLL_ACT", 3.0),)))
    line.run(SAVE_AFTER_S + 1.0)
    again = parameter_line(PX4, store=store)
    again.until(lambda: complete(again))
    assert again.sent_count("PARAM_REQUEST_LIST") == 1


def test_where_single_values_are_slow_and_many_are_missing_the_list_is_asked_for_again() -> None:
    """Simulates an agent that was not scheduled for a moment while a thousand arrived at once."""
    line = parameter_line(total_count=1400)
    line.server.server.is_slow = True
    burst = range(200, 900)
    line.to_agent = lambda number, _message: () if number in burst else (0.0,)
    assert line.until(lambda: complete(line)) < FAST.list_after_s + 2.5
    assert line.sent_count("PARAM_REQUEST_LIST") == 2
    line.do(ParametersReadWork())
    assert tables(line) == [table_of(line)]


def test_a_pause_in_the_list_that_is_like_those_before_is_no_end_of_it() -> None:
    line = parameter_line(total_count=1400)
    line.to_agent = lambda number, _message: (0.2 * (number // 300),)
    line.until(lambda: complete(line))
    assert line.sent_count("PARAM_REQUEST_READ") == 0


def test_after_a_moment_without_the_processor_the_lost_end_of_the_list_is_soon_asked_for() -> None:
    line = parameter_line(total_count=1400)
    begun = line.now + FAST.list_after_s + 0.1

    def loses_the_end(number: int, _message: Message) -> tuple[float, ...]:
        return () if 1300 <= number < 1420 else (0.1 * (number // 300) if number < 1300 else 0.0,)

    line.to_agent = loses_the_end
    line.until(lambda: line.now > begun and line.sent_count("PARAM_REQUEST_LIST") == 1)
    line.run(0.15)
    line.now += 7.0  # the program is suspended; what came meanwhile is read at once afterwards
    assert line.until(lambda: complete(line)) < LONGEST_QUIETS * FAST.quiet_s + 2.5, "the rest of the list, and its end"
    assert line.sent_count("PARAM_REQUEST_READ") > 0
