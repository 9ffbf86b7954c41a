"""Parameters are written one by one to the simulator's own server half. Each refusal has the name and a message."""

from __future__ import annotations

import math
import struct
from typing import Any

import pytest
from handler_line import ARDUPILOT, PX4, HandlerLine, arrives
from hypothesis import given
from hypothesis import strategies as st
from parameter_reading_line import complete, parameter_line

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender
from onboard_agent.transactions.parameter_encoding import (
    Encoding,
    ParameterSetting,
    as_kept,
    encoding_of,
    read_param_value,
    why_not,
    words_of,
)
from simulator.dialect import Message, mavlink
from wire.dialect import build
from wire.frames import checksum_holds, payload
from wire.transactions import (
    Outcome,
    ParameterCache,
    ParameterChanged,
    ParameterRefusal,
    ParametersReadWork,
    ParametersWriteWork,
    TransactionProgress,
    TransactionResult,
)

KINDS = {1: "B", 2: "b", 3: "H", 4: "h", 5: "I", 6: "i"}


def ready(kind: int = ARDUPILOT, **options: Any) -> HandlerLine:
    line = parameter_line(kind, **options)
    line.until(lambda: complete(line))
    line.run(1.0)
    line.reports.clear()
    line.sent.clear()
    return line


def write(line: HandlerLine, *values: tuple[str, float], **options: Any) -> Any:
    return line.do(ParametersWriteWork(values), **options)


def has(line: HandlerLine, name: str) -> float:
    return line.server.parameters.find(name).value


def sets(line: HandlerLine) -> list[str]:
    return [message.param_id for message in line.sent if message.get_type() == "PARAM_SET"]


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        (ARDUPILOT, [("RTL_ALT", 3000.0), ("WPNAV_SPEED", 612.5), ("FS_OPTIONS", -7.0)]),
        (PX4, [("NAV_DLL_ACT", 2.0), ("RTL_RETURN_ALT", 0.1), ("COM_DL_LOSS_T", -3.0)]),
    ],
    ids=["ardupilot", "px4"],
)
def test_values_are_written_in_order_and_read_back(kind: int, values: list[tuple[str, float]]) -> None:
    line = ready(kind)
    before = line.now
    result = write(line, *values)
    assert (result.outcome, result.refusals) == (Outcome.DONE, ())
    assert result.words == "3 of 3 parameters are written and read back."
    assert [has(line, name) for name, _ in values] == [as_kept(value, 9) for _, value in values]
    asked = [(message.get_type(), message.param_id) for message in line.sent]
    assert asked == [(what, name) for name, _ in values for what in ("PARAM_SET", "PARAM_REQUEST_READ")]
    assert line.now - before < 0.1
    changed = [type(one) for one in line.reports]
    assert changed.index(ParameterChanged) < len(changed) - 1  # the new table is reported before completion
    assert [one.name for one in line.reported(ParameterChanged)] == [name for name, _ in values]


@pytest.mark.parametrize("flavour", [ARDUPILOT, PX4], ids=["ardupilot", "px4"])
def test_what_cannot_be_is_refused_without_being_sent(flavour: int) -> None:
    line = ready(flavour)
    whole = "RTL_ALT" if flavour == ARDUPILOT else "NAV_DLL_ACT"
    real = "WPNAV_SPEED" if flavour == ARDUPILOT else "NAV_ACC_RAD"
    asked = [
        (whole, 1.5, "Whole numbers only."),
        (whole, 3e9, "It takes whole numbers from -2147483648 to 2147483647."),
        (whole, math.nan, "It takes a number."),
        (real, math.inf, "It takes a number."),
        (real, 1e39, "The number is too large."),
        ("_HASH_CHECK", 0.0, "No parameter can have this name."),
        ("TWO WORDS", 0.0, "No parameter can have this name."),
    ]
    result = write(line, *((name, value) for name, value, _ in asked))
    assert result.outcome is Outcome.FAILED
    assert [refusal.words for refusal in result.refusals] == [words for _, _, words in asked]
    assert result.refusals[0] == ParameterRefusal(whole, 1.5, has(line, whole), asked[0][2])
    assert sets(line) == []


def test_a_small_whole_number_has_its_own_limits_and_a_cast_its_own() -> None:
    line = ready()
    result = write(line, ("FS_THR_ENABLE", 200.0), ("LOG_BITMASK", 16777217.0), ("LOG_BITMASK", 16777216.0))
    assert [refusal.words for refusal in result.refusals] == [
        "It takes whole numbers from -128 to 127.",
        "The autopilot's protocol cannot carry this number exactly.",
    ]
    assert has(line, "LOG_BITMASK") == 16777216.0
    assert result.words == "1 of 3 parameters is written and read back, not FS_THR_ENABLE, LOG_BITMASK."


def test_a_value_that_the_autopilot_clamps_keeps_or_does_not_know_is_told_by_name() -> None:
    line = ready()
    real = line.server.parameters.from_the_wire

    def own_way(name: str, value: float, kind: int) -> Any:
        if name == "RTL_ALT":
            return real(name, min(value, 8000.0), kind)
        if name == "RTL_SPEED":
            return line.server.parameters.find(name)
        return real(name, value, kind)

    line.server.parameters.from_the_wire = own_way
    result = write(line, ("RTL_ALT", 9000.0), ("RTL_SPEED", 500.0), ("RTL_NOTHING", 1.0), ("LAND_SPEED", 60.0))
    assert result.outcome is Outcome.FAILED
    assert result.refusals == (
        ParameterRefusal("RTL_ALT", 9000.0, 8000.0, "The autopilot changed it to 8000."),
        ParameterRefusal("RTL_SPEED", 500.0, 0.0, "The autopilot keeps 0."),
        ParameterRefusal(
            "RTL_NOTHING", 1.0, None, "The autopilot knows no parameter of this name, or does not answer."
        ),
    )
    assert (result.refused, has(line, "LAND_SPEED")) == (3, 60.0)
    assert result.words == "1 of 4 parameters is written and read back, not RTL_ALT, RTL_SPEED, RTL_NOTHING."


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0.0, "0"),
        (8000.0, "8000"),
        (4.300000190734863, "4.3"),
        (16777215.0, "16777215"),
        (3.4028234663852886e38, "3.4028235e+38"),
    ],
)
def test_a_value_is_told_as_people_write_it(value: float, words: str) -> None:
    assert words_of(value) == words


def test_one_that_is_not_listed_is_asked_for_by_name_and_then_written() -> None:
    line = ready(PX4)
    line.handler._table.values.pop("NAV_DLL_ACT")
    assert write(line, ("NAV_DLL_ACT", 3.0)).outcome is Outcome.DONE
    assert has(line, "NAV_DLL_ACT") == 3.0
    assert [message.get_type() for message in line.sent][:2] == ["PARAM_REQUEST_READ", "PARAM_SET"]


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (mavlink.MAV_PARAM_ERROR_READ_ONLY, "It can be read only."),
        (mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST, "The autopilot has no parameter of this name."),
        (99, "The autopilot answers with error 99."),
    ],
)
def test_an_autopilot_that_says_what_is_wrong_is_quoted(error: int, words: str) -> None:
    line = ready()
    receive = line.server.receive

    def refuses(message: Message) -> None:
        if message.get_type() == "PARAM_SET":
            line.say(mavlink.MAVLink_param_error_message(1, 190, b"RTL_ALT", -1, 1))  # to another ground station
            line.say(mavlink.MAVLink_param_error_message(1, 191, b"RTL_ALT", -1, error))
        else:
            receive(message)

    line.server.receive = refuses
    result = write(line, ("RTL_ALT", 2000.0))
    assert [refusal.words for refusal in result.refusals] == [words]


def test_a_value_of_before_that_comes_late_is_not_believed() -> None:
    line = ready()
    old = mavlink.MAVLink_param_value_message(b"RTL_ALT", 1500.0, 6, 1390, 7)
    line.begin(ParametersWriteWork((("RTL_ALT", 2000.0),)))
    line.to_server = lambda number, _message: (0.05,)
    line.step()
    line.say(old)
    line.run(0.03)
    line.say(old)
    assert line.result().outcome is Outcome.DONE
    assert sets(line) == ["RTL_ALT", "RTL_ALT"]
    assert has(line, "RTL_ALT") == 2000.0


@pytest.mark.parametrize("lost", [("PARAM_SET",), ("PARAM_VALUE",), ("PARAM_SET", "PARAM_VALUE", "PARAM_REQUEST_READ")])
def test_each_frame_is_lost_once(lost: tuple[str, ...]) -> None:
    line = ready()
    gone: set[str] = set()

    def once(_number: int, message: Message) -> tuple[float, ...]:
        name = message.get_type()
        if name in lost and name not in gone:
            gone.add(name)
            return ()
        return (0.0,)

    line.to_server = line.to_agent = once
    assert write(line, ("RTL_ALT", 2000.0), ("LAND_SPEED", 60.0)).outcome is Outcome.DONE
    assert gone == set(lost)


def test_an_autopilot_that_says_nothing_any_more_ends_it_and_what_was_not_sent_is_told() -> None:
    line = ready()
    line.to_agent = lambda _number, _message: ()
    names = [f"RC{number}_TRIM" for number in range(1, 9)]
    result = write(line, *((name, 1501.0) for name in names))
    assert result.outcome is Outcome.FAILED
    assert result.words == (
        "The autopilot does not answer any more: 0 of 8 parameters are written and read back, not RC1_TRIM, RC2_TRIM; "
        "6 were not sent."
    )
    assert [refusal.has for refusal in result.refusals] == [None, None, *[1500.0] * 6]
    assert result.refused == 8
    assert set(sets(line)) == {"RC1_TRIM", "RC2_TRIM"}


def test_silence_about_one_and_then_another_is_no_silence() -> None:
    line = ready()
    lost = ("RC1_TRIM", "RC3_TRIM", "RC5_TRIM")
    line.to_agent = lambda _number, message: () if message.param_id in lost else (0.0,)
    result = write(line, *((f"RC{number}_TRIM", 1501.0) for number in range(1, 7)))
    assert [refusal.name for refusal in result.refusals] == list(lost)
    assert result.words.startswith("3 of 6 parameters are written")


def test_it_taken_but_cannot_be_read_back() -> None:
    line = ready()
    line.to_server = lambda _number, message: () if message.get_type() == "PARAM_REQUEST_READ" else (0.0,)
    (refusal,) = write(line, ("RTL_ALT", 2000.0)).refusals
    assert (refusal.has, refusal.words) == (2000.0, "It was accepted but could not be read back.")


@pytest.mark.parametrize(
    ("outcome", "words", "stop"),
    [
        (Outcome.CANCELLED, "It was cancelled: ", lambda line: line.handler.cancel(1, line.now)),
        (
            Outcome.STALE_EPOCH,
            "The controls changed hands meanwhile: ",
            lambda line: line.handler.epoch_changed(2, line.now),
        ),
    ],
    ids=["cancelled", "epoch"],
)
def test_told_to_stop_it_ends_the_one_that_it_is_at(outcome: Outcome, words: str, stop: Any) -> None:
    line = ready()
    names = [f"RC{number}_TRIM" for number in range(1, 9)]
    line.begin(ParametersWriteWork(tuple((name, 1501.0) for name in names)))
    line.until(lambda: len(sets(line)) == 3)
    stop(line)
    result = line.result()
    assert result.outcome is outcome
    assert result.words == f"{words}3 of 8 parameters are written and read back; 5 were not sent."
    assert [has(line, name) for name in names] == [1501.0] * 3 + [1500.0] * 5
    assert [refusal.name for refusal in result.refusals] == names[3:]


def test_the_deadline_ends_it_at_once_and_says_that_one_is_not_known() -> None:
    line = ready()
    line.to_agent = lambda _number, _message: ()
    result = write(line, ("RTL_ALT", 2000.0), ("LAND_SPEED", 60.0), deadline_s=0.3)
    assert result.outcome is Outcome.TIMED_OUT
    assert "It is not known whether it has the new value" in result.refusals[0].words
    assert result.refusals[1].words == "Not sent."


def test_a_second_write_is_refused_a_table_is_told_meanwhile() -> None:
    line = ready()
    first = line.begin(ParametersWriteWork((("RTL_ALT", 2000.0),)))
    assert line.do(ParametersWriteWork((("RTL_ALT", 1.0),))).words == "Busy: parameters are being written."
    assert line.do(ParametersReadWork(again=True)).outcome is Outcome.REFUSED
    assert line.do(ParametersReadWork()).outcome is Outcome.DONE
    assert line.result(first).outcome is Outcome.DONE


def test_nothing_is_begun_with_an_autopilot_that_is_not_heard() -> None:
    line = ready()
    line.around_options["heard"] = False
    for work in (ParametersWriteWork((("RTL_ALT", 2000.0),)), ParametersReadWork(again=True)):
        assert line.do(work).words == "No heartbeat from the autopilot."
    assert line.sent == []


def test_it_reboots_in_the_middle_and_the_write_goes_on() -> None:
    line = ready()
    names = [f"RC{number}_TRIM" for number in range(1, 9)]
    line.begin(ParametersWriteWork(tuple((name, 1501.0) for name in names)))
    line.until(lambda: len(sets(line)) == 3)
    deaf_until = line.now + 1.2
    line.to_server = line.to_agent = lambda _number, _message: (0.0,) if line.now > deaf_until else ()
    line.run(1.0)
    line.comes()
    result = line.result()
    assert (result.outcome, result.refused) == (Outcome.DONE, 0)
    line.until(lambda: complete(line))


def test_many_are_written_with_progress_five_times_a_second() -> None:
    line = ready()
    line.to_server = lambda _number, _message: (0.03,)
    names = [row.name for row in line.server.parameters if row.name.startswith("SERVO")][:40]
    values = tuple((name, has(line, name)) for name in names)
    number = line.begin(ParametersWriteWork(values))
    began = line.now
    assert line.result(number).outcome is Outcome.DONE
    progress = [one for one in line.reported(TransactionProgress) if one.id == number]
    assert all(one.phase == "writing" and one.total == 40 for one in progress)
    assert len(progress) <= (line.now - began) * 5 + 1
    assert [one.done for one in progress] == sorted({one.done for one in progress})


def test_a_new_tower_is_told_the_table_while_parameters_are_written() -> None:
    line = ready()
    line.begin(ParametersWriteWork(tuple((f"RC{number}_TRIM", 1501.0) for number in range(1, 9))))
    line.until(lambda: len(sets(line)) == 2)
    line.run(0.02)
    assert line.reported(ParameterCache) == line.reported(ParameterChanged) == []
    line.handler.resend()
    line.step()
    assert [one.count for one in line.reported(ParameterCache)] == [1390]


# Encoding of a value in transit.


@given(st.sampled_from(sorted(KINDS)), st.data())
def test_every_integer_of_px4_travels_bit_for_bit(kind: int, data: st.DataObject) -> None:
    bits = struct.calcsize(KINDS[kind]) * 8
    low, high = (0, 2**bits - 1) if KINDS[kind].isupper() else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    value = data.draw(st.integers(low, high))
    assert why_not(value, kind, Encoding.BYTES) is None
    setting = ParameterSetting(1, "SIXTEEN_LETTERS_", value, kind, Encoding.BYTES)
    frame = FrameMaker().make(setting, agent_sender(1))
    assert checksum_holds(frame)
    raw = payload(frame)[:4]
    assert raw == struct.pack("<" + KINDS[kind], value).ljust(4, b"\0")
    reported = build(
        mavlink.MAVLink_param_value_message(b"A", 0.0, kind, 1, 1), system_id=1, component_id=1, sequence=0
    )
    assert read_param_value(reported[:10] + raw + reported[14:], Encoding.BYTES).parameter.value == value


@pytest.mark.parametrize("value", [0x7FA00001, -0x005FFFFF], ids=["positive", "negative"])
def test_an_integer_whose_bytes_are_a_signalling_nan_is_not_made_another(value: int) -> None:
    frame = FrameMaker().make(ParameterSetting(1, "A", value, 6, Encoding.BYTES), agent_sender(1))
    assert struct.unpack_from("<i", payload(frame)) == (value,)


@given(st.floats(width=32, allow_nan=False, allow_infinity=False), st.sampled_from(list(Encoding)))
def test_a_float_travels_the_same_in_both(value: float, encoding: Encoding) -> None:
    frame = FrameMaker().make(ParameterSetting(1, "A", value, 9, encoding), agent_sender(1))
    assert payload(frame)[:4] == struct.pack("<f", value)


def test_the_capabilities_say_how_an_integer_travels_and_else_the_kind_of_the_autopilot() -> None:
    cast = mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
    bytewise = mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
    assert encoding_of(PX4, 0) is Encoding.BYTES
    assert encoding_of(ARDUPILOT, 0) is Encoding.CAST
    assert encoding_of(PX4, cast) is Encoding.CAST
    assert encoding_of(ARDUPILOT, bytewise) is Encoding.BYTES


def system_id_line(**around: Any) -> HandlerLine:
    line = ready(**around)
    assert has(line, "SYSID_THISMAV") == 1
    return line


def rename(line: HandlerLine, system_id: int) -> None:
    """The autopilot sends as another system from now on, and the agent has found it."""
    line.become(system_id)
    line.comes()


def test_a_system_id_that_counts_at_once_is_read_back_from_the_new_system() -> None:
    line = system_id_line()
    line.to_agent = lambda number, message: ()  # it answers as system 7, which the agent drops
    line.begin(ParametersWriteWork((("SYSID_THISMAV", 7.0), ("RTL_ALT", 2000.0))))
    line.run(6.0)
    assert line.reported(TransactionResult) == [], "it is waited for longer than for another parameter"
    line.to_agent = arrives
    rename(line, 7)
    line.run(1.0)
    (result,) = line.reported(TransactionResult)
    assert result.outcome is Outcome.DONE
    assert result.words == (
        "2 of 2 parameters are written and read back. The autopilot is system 7 now, and the agent follows it."
    )
    assert {message.target_system for message in line.sent if message.get_type() == "PARAM_SET"} == {1, 7}


def test_a_system_id_that_counts_after_a_restart_is_said_to_do_so() -> None:
    line = system_id_line()
    result = write(line, ("SYSID_THISMAV", 7.0))
    assert (result.outcome, result.words) == (
        Outcome.DONE,
        "1 of 1 parameters is written and read back. The autopilot becomes system 7 when it restarts. Do not fly "
        "before: it may ignore sticks.",
    )


def test_an_autopilot_that_is_gone_after_the_write_is_told_as_unknown() -> None:
    line = system_id_line()
    line.to_agent = lambda number, message: ()
    line.begin(ParametersWriteWork((("SYSID_THISMAV", 7.0),)))
    line.run(12.0)
    (result,) = line.reported(TransactionResult)
    assert result.outcome is Outcome.FAILED
    assert "not known" in result.refusals[0].words
    # Another autopilot than the one with the new id is no answer.
    line = system_id_line()
    line.to_agent = lambda number, message: ()
    line.begin(ParametersWriteWork((("SYSID_THISMAV", 7.0),)))
    line.run(4.0)
    line.to_agent = arrives
    rename(line, 9)
    line.run(0.1)
    (result,) = line.reported(TransactionResult)
    assert result.outcome is Outcome.FAILED
    assert result.words.startswith("Another autopilot is there now")


@pytest.mark.parametrize(
    ("around", "wanted", "words"),
    [
        ({"armed": True}, 7.0, "The system id is changed on the ground only, when the drone is disarmed."),
        ({"system_is_fixed": True}, 7.0, "The agent serves system 1 alone (`system_id` in its settings)"),
        ({"other_systems": (7,)}, 7.0, "Another autopilot on this line is system 7."),
        ({}, 0.0, "A vehicle's system id is 1 to 254."),
        ({}, 255.0, "A vehicle's system id is 1 to 254."),
    ],
)
def test_a_system_id_that_would_lose_the_drone_is_not_sent(around: dict[str, Any], wanted: float, words: str) -> None:
    line = system_id_line(**around)
    result = write(line, ("SYSID_THISMAV", wanted))
    assert result.outcome is Outcome.FAILED
    assert result.refusals[0].words.startswith(words)
    assert sets(line) == []
