"""Lines of JSON from a sensor: what passes, what is dropped and why, and when it was measured."""

import itertools
import json
from functools import reduce
from operator import xor
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard_agent.payload.sensor_lines import (
    EVENT_INTERVAL_S,
    MAX_LINE_BYTES,
    MAX_NAMES,
    MIN_INTERVAL_S,
    BadLine,
    SensorLines,
    parse_line,
)
from wire.dialect import decode


def fed(lines: SensorLines, data: bytes, now: float = 10.0) -> list[Any]:
    return [decode(frame) for frame in lines.feed(data, now, 3)]


def test_values_and_events_become_messages_of_the_companion_computer() -> None:
    seen = fed(SensorLines(), b'{"co2_ppm": 415.5, "temp_c": -3}\r\n\n{"event": "sample taken"}\n')
    assert [one.get_type() for one in seen] == ["NAMED_VALUE_FLOAT", "NAMED_VALUE_FLOAT", "STATUSTEXT"]
    assert [(one.name, one.value, one.time_boot_ms) for one in seen[:2]] == [
        ("co2_ppm", 415.5, 10_000),
        ("temp_c", -3.0, 10_000),
    ]
    assert seen[2].text == "sample taken"
    assert {(one.get_srcSystem(), one.get_srcComponent()) for one in seen} == {(3, 191)}


@pytest.mark.parametrize(
    ("line", "why"),
    [
        (b"co2=5", "not JSON"),
        (b'{"a": NaN}', "not JSON"),
        (b'{"a": 1', "not JSON"),
        (b'{"a": "\xff"}', "not JSON"),
        (b"[" * 300, "not JSON"),
        (b"[1]", "not an object"),
        (b"{}", "not an object"),
        (b'{"t": 5}', "nothing in it"),
        (b'{"a": "1"}', "not a number"),
        (b'{"a": true}', "not a number"),
        (b'{"a": null}', "not a number"),
        (b'{"a": 1e39}', "not a number"),
        (b'{"a": 1' + b"0" * 400 + b"}", "not a number"),
        (b'{"a": {"b": 1}}', "not a number"),
        (b'{"name_too_long": 1}', "bad name"),
        (b'{"1a": 1}', "bad name"),
        (b'{"event": 5}', "bad event"),
        (b'{"event": "' + b"x" * 51 + b'"}', "bad event"),
        (b'{"event": "a\\u0007"}', "bad event"),
        (b'{"a": 1, "t": -1}', "bad time"),
        (b'{"a": 1, "t": "now"}', "bad time"),
        (json.dumps({f"v{number}": 1 for number in range(17)}).encode(), "too many values"),
        (b'{"a": 1}*00', "wrong checksum"),
    ],
)
def test_a_line_that_breaks_a_rule_is_dropped_and_counted(line: bytes, why: str) -> None:
    lines = SensorLines()
    assert fed(lines, line + b"\n" + b'{"ok": 1}\n')[0].name == "ok"
    assert lines.counts == {why: 1}


def test_a_right_checksum() -> None:
    text = b'{"a": 1.5}'
    total = b"*%02x" % reduce(xor, text)
    assert parse_line(text + total) == ({"a": 1.5}, "", None)


@given(st.binary(max_size=600))
def test_any_line_is_values_or_a_reason(line: bytes) -> None:
    try:
        values, event, _ = parse_line(line)
    except BadLine as bad:
        assert str(bad)
    else:
        assert values or event


@given(st.lists(st.integers(1, 30), max_size=30), st.binary(max_size=60))
def test_portions_and_noise(sizes: list[int], noise: bytes) -> None:
    data = noise + b"\n" + b'{"a": 1, "b": 2}\n'
    lines, seen = SensorLines(), list[Any]()
    for size in sizes:
        seen += fed(lines, data[:size])
        data = data[size:]
    seen += fed(lines, data)
    assert [one.name for one in seen][-2:] == ["a", "b"]


def test_an_endless_line_holds_no_memory() -> None:
    lines = SensorLines()
    for _ in range(100):
        assert fed(lines, b"x" * 400) == []
    assert lines.counts["line too long"] >= 1
    assert len(lines._buffer) <= MAX_LINE_BYTES
    assert [one.name for one in fed(lines, b' tail\n{"a": 1}\n')] == ["a"]


def test_rates_are_bounded() -> None:
    lines = SensorLines()
    sent = sum(len(fed(lines, b'{"a": 1}\n', tick * 0.01)) for tick in range(1000))
    assert sent <= 10.0 / MIN_INTERVAL_S + 1
    assert lines.counts["too fast"] == 1000 - sent
    events = sum(len(fed(lines, b'{"event": "e"}\n', 100 + tick * 0.1)) for tick in range(100))
    assert events <= 10.0 / EVENT_INTERVAL_S + 1
    for number in range(MAX_NAMES + 5):
        fed(lines, b'{"n%d": 1}\n' % number, 200.0)
    assert lines.counts["too many names"] == 6


def test_the_sensors_clock_takes_the_jitter_of_the_line_away() -> None:
    lines = SensorLines()
    late_ms = (30, 2, 80, 5, 60)
    stamps = []
    for number, late in enumerate(late_ms):
        clock_ms = 5000 + number * 1000
        (one,) = fed(lines, b'{"a": 1, "t": %d}\n' % clock_ms, 100.0 + number + late / 1000)
        stamps.append(one.time_boot_ms)
    assert [after - before for before, after in itertools.pairwise(stamps[1:])] == [1000, 1000, 1000]
    assert stamps[1] == 101_002
    (restarted,) = fed(lines, b'{"a": 1, "t": 10}\n', 200.0)
    assert restarted.time_boot_ms == 200_000


def test_after_a_new_beginning_half_a_line_is_nothing() -> None:
    lines = SensorLines()
    assert fed(lines, b'{"a": 1, "b') == []
    lines.restart()
    assert [one.name for one in fed(lines, b'": 5}\n{"c": 2}\n')] == ["c"]
