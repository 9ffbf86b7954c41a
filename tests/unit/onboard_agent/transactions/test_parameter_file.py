"""All parameters by the autopilot's file: complete or not at all, whatever is lost; by the list if there is no file."""

from __future__ import annotations

import contextlib
from random import Random
from typing import Any

import pytest
from handler_line import HandlerLine
from hypothesis import given, settings
from hypothesis import strategies as st
from parameter_reading_line import Half, MemoryStore, complete, table_of, tables
from worlds.tiers import examples

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions.file_read import BLOCK_TRIES
from onboard_agent.transactions.parameter_encoding import as_kept
from onboard_agent.transactions.parameter_file import BadParameterFile, read_parameter_file
from onboard_agent.transactions.parameter_frames import FAST
from onboard_agent.transactions.parameter_handler import ParameterHandler
from simulator.dialect import Message, mavlink
from simulator.file_protocol import ACK, OPEN_TO_READ, READ, TERMINATE, FileServer
from simulator.parameter_pack import pack_parameters
from simulator.parameters import Parameters
from wire.parameters import Parameter as Row
from wire.parameters import table_hash
from wire.transactions import Outcome, ParameterCache, ParameterChanged, ParametersReadWork

FILES = "FILE_TRANSFER_PROTOCOL"
BLOCK = 239


class FilingHalf(Half):
    """Adds its file server, with `at_file` between the two."""

    def __init__(self, line: HandlerLine, parameters: Parameters) -> None:
        super().__init__(line, parameters)
        self.files = FileServer(parameters, line.say)
        self._line = line

    def receive(self, message: Message) -> None:
        if message.get_type() == FILES:
            self.files.receive(message, (message.get_srcSystem(), message.get_srcComponent()))
        super().receive(message)

    def tick(self) -> None:
        self.files.tick(self._line.now)
        super().tick()


def filing_line(*, total: int = 1400, **options: Any) -> HandlerLine:
    """An autopilot that starts to send and offers files."""
    line = HandlerLine(ParameterHandler(FrameMaker(), MemoryStore()), **options)
    line.server = FilingHalf(line, Parameters(total_count=total))
    line.comes()
    names = (mavlink.MAV_PROTOCOL_CAPABILITY_FTP, 0, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0)
    line.say(mavlink.MAVLink_autopilot_version_message(*names))
    return line


def asked(line: HandlerLine, op: int) -> int:
    return sum(1 for one in line.sent if one.get_type() == FILES and one.payload[3] == op)


def read_again(line: HandlerLine) -> float:
    """Returns the duration, and asserts that the table equals the autopilot's."""
    began = line.now
    assert line.do(ParametersReadWork(again=True)).outcome is Outcome.DONE
    assert tables(line)[-1] == table_of(line)
    return line.now - began


def test_the_file_is_read_in_a_fraction_of_what_the_list_takes() -> None:
    line = filing_line()
    assert line.until(lambda: complete(line)) < FAST.list_after_s + 0.35
    assert line.sent_count("PARAM_REQUEST_LIST") == 0
    assert read_again(line) < 0.35
    assert asked(line, OPEN_TO_READ) == asked(line, TERMINATE) == 2
    assert [one for one in line.passed_up if one.get_type() == FILES] == []
    reported = [one for one in line.reported(ParameterCache) if one.hash is not None]
    assert reported[-1].count == reported[-1].total == 1400


def test_what_is_lost_is_asked_for_after_a_round_trip_and_not_after_half_a_second() -> None:
    line = filing_line()
    line.until(lambda: complete(line))
    line.to_agent = lambda number, message: () if message.get_type() == FILES and number % 7 == 0 else (0.0,)
    assert read_again(line) < 1.2


@settings(max_examples=examples(15, long=50), deadline=None)
@given(seed=st.integers(0, 1 << 32))
def test_whatever_is_lost_doubled_and_overtaken_the_table_is_whole(seed: int) -> None:
    random = Random(seed)
    line = filing_line(total=0)

    def fault(_number: int, _message: Message) -> tuple[float, ...]:
        return tuple(random.random() * 0.05 for _ in range(random.choice((0, 1, 1, 1, 1, 2))))

    line.to_agent = line.to_server = fault
    line.until(lambda: complete(line), 60)
    line.to_agent = line.to_server = lambda _number, _message: (0.0,)
    assert line.do(ParametersReadWork()).outcome is Outcome.DONE
    assert tables(line)[-1] == table_of(line)


def test_a_table_that_the_tower_has_is_not_sent_again() -> None:
    line = filing_line()
    line.until(lambda: complete(line))
    for _ in range(3):
        read_again(line)
    assert len(tables(line)) == 1
    line.handler.resend()
    read_again(line)
    assert len(tables(line)) == 2
    line.server.server.set("RTL_ALT", 4321, 6)
    line.run(1.0)
    assert line.do(ParametersReadWork(again=True)).outcome is Outcome.DONE
    assert len(tables(line)) == 2, "the tower has it by the change that it was told"
    assert line.reported(ParameterChanged)[-1].hash == table_hash(table_of(line))
    line.do(ParametersReadWork())
    assert len(tables(line)) == 3, "a tower that asks for what is known does not have it"
    assert tables(line)[-1] == table_of(line)


def test_where_no_file_is_opened_the_list_is_read() -> None:
    line = filing_line()
    line.server.files.refuses = True
    line.until(lambda: complete(line))
    assert line.sent_count("PARAM_REQUEST_LIST") == 1
    read_again(line)


def test_an_autopilot_that_answers_nothing_about_files_costs_a_second_and_a_half() -> None:
    line = filing_line()
    line.to_server = lambda _number, message: () if message.get_type() == FILES else (0.0,)
    assert line.until(lambda: complete(line)) < FAST.list_after_s + 3 * FAST.answer_s + 0.75


def test_a_block_that_never_comes_leaves_it_to_the_list() -> None:
    line = filing_line()

    def lacks(_number: int, message: Message) -> tuple[float, ...]:
        is_block = message.get_type() == FILES and message.payload[3] == READ
        return () if is_block and message.payload[8:12] == [239 * 9 & 255, 239 * 9 >> 8, 0, 0] else (0.0,)

    line.to_server = lacks
    line.until(lambda: complete(line))
    assert sum(1 for one in line.sent if one.get_type() == FILES and lacks(0, one) == ()) == BLOCK_TRIES
    assert line.sent_count("PARAM_REQUEST_LIST") == 1
    line.do(ParametersReadWork())
    assert tables(line)[-1] == table_of(line)


def test_a_session_that_was_left_open_is_closed_and_another_ones_is_left_alone() -> None:
    line = filing_line()
    line.to_server = lambda _number, message: (
        () if message.get_type() == FILES and message.payload[3] == TERMINATE else (0.0,)
    )
    line.until(lambda: complete(line))
    line.to_server = lambda _number, _message: (0.0,)
    assert read_again(line) < 0.4
    assert line.sent_count("PARAM_REQUEST_LIST") == 0
    line.run(0.1)
    name = b"@PARAM/param.pck"
    payload = bytes([1, 0, 7, OPEN_TO_READ, len(name), 0, 0, 0, 0, 0, 0, 0]) + name
    line.server.files.receive(
        mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload.ljust(251, b"\0")), (255, 190)
    )
    line.step()
    read_again(line)
    assert line.sent_count("PARAM_REQUEST_LIST") == 1
    answers = [one for one in line.passed_up if one.get_type() == FILES]
    assert [(one.target_system, one.payload[3]) for one in answers] == [(255, ACK)], "it is the station's"


def test_a_value_that_is_told_meanwhile_is_newer_than_the_file() -> None:
    line = filing_line()
    line.until(lambda: complete(line))
    number = line.begin(ParametersReadWork(again=True))
    line.run(0.1)
    old = line.server.parameters["RTL_ALT"]
    line.server.server.set("RTL_ALT", old + 70, 6)
    line.server.parameters._by_name["RTL_ALT"].value = old  # as if its block had been sent before
    line.result(number)
    assert {one.name: one.value for one in tables(line)[-1]}["RTL_ALT"] == old + 70


def test_a_file_whose_parameters_move_while_it_is_read_is_read_again() -> None:
    line = filing_line()
    line.until(lambda: complete(line))
    number = line.begin(ParametersReadWork(again=True))
    line.run(0.05)
    del line.server.parameters._ordered[700]
    line.server.files._content = pack_parameters(line.server.parameters, BLOCK)
    assert line.result(number).outcome is Outcome.DONE
    assert tables(line)[-1] == table_of(line)
    assert line.sent_count("PARAM_REQUEST_LIST") == 0


@pytest.mark.parametrize("count", [0, 1391, 1999])
def test_file_and_list_tell_the_same(count: int) -> None:
    parameters = Parameters(total_count=count)
    found = read_parameter_file(pack_parameters(parameters, BLOCK))
    assert found.count == len(parameters)
    assert found.parameters == tuple(
        Row(one.name, as_kept(one.value, int(one.kind)), int(one.kind)) for one in parameters
    )


PACKED = pack_parameters(Parameters(), BLOCK)


@given(cut=st.integers(0, len(PACKED) - 1))
def test_a_file_that_is_cut_is_no_table(cut: int) -> None:
    with pytest.raises(BadParameterFile):
        read_parameter_file(PACKED[:cut])


@given(at=st.integers(6, len(PACKED) - 1), value=st.integers(0, 255))
def test_no_byte_that_is_wrong_raises_anything_else(at: int, value: int) -> None:
    with contextlib.suppress(BadParameterFile):
        read_parameter_file(PACKED[:at] + bytes([value]) + PACKED[at + 1 :])


@given(st.binary(max_size=400))
def test_whatever_comes_is_read_or_refused(data: bytes) -> None:
    with pytest.raises(BadParameterFile):
        read_parameter_file(data)
