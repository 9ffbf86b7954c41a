"""A stored parameter table: by chip, verified, saved while disarmed."""

from __future__ import annotations

from typing import Any

import pytest
from parameter_reading_line import MemoryStore, complete, parameter_line, remembered, table_of

from onboard_agent.transactions.parameter_memory import Remembered, recall, remember
from simulator.dialect import Message, mavlink
from wire.parameters import Parameter as Row
from wire.parameters import table_hash
from wire.transactions import (
    Outcome,
    ParameterCache,
    ParameterChanged,
    ParametersReadWork,
    ParameterTable,
)

# The stored table.


def version(capabilities: int = 0, uid: int = 0, uid2: tuple[int, ...] = (0,) * 18) -> Message:
    eight = [0] * 8
    return mavlink.MAVLink_autopilot_version_message(
        capabilities, 1, 1, 1, 1, eight, eight, eight, 0, 0, uid, list(uid2)
    )


def test_a_remembered_table_is_told_at_once_as_such_and_then_verified() -> None:
    store = remembered()
    assert list(store.records) == ["ardupilotmega-1"]
    line = parameter_line(store=store)
    line.server.parameters.set("RTL_ALT", 3333.0)
    old = table_hash(tuple(row if row.name != "RTL_ALT" else Row("RTL_ALT", 1500.0, 6) for row in table_of(line)))
    line.until(lambda: line.reported(ParameterCache))
    first = line.reported(ParameterCache)[0]
    assert (first.hash, first.verified) == (old, False)
    assert not line.reported(ParameterTable)
    known = line.do(ParametersReadWork())
    assert (known.outcome, "remembered" in known.words) == (Outcome.DONE, True)
    line.until(lambda: complete(line))
    assert line.reported(ParameterChanged) == [
        ParameterChanged(name="RTL_ALT", value=3333.0, kind=6, before=old, hash=table_hash(table_of(line)))
    ]


def test_it_is_remembered_by_its_chip_and_another_chip_has_its_own() -> None:
    store = remembered(said=version(uid2=(7, *(0,) * 17)))
    assert list(store.records) == [f"chip-07{'00' * 17}"]
    line = parameter_line(store=store)
    line.say(version(uid=99))
    line.until(lambda: complete(line))
    assert not any(one.hash and not one.verified for one in line.reported(ParameterCache))
    line.until(lambda: len(store.records) == 2)
    assert "chip-0000000000000063" in store.records


@pytest.mark.parametrize(
    "damage", [lambda b: b[: len(b) // 2], lambda b: b"", lambda b: b.replace(b"packed", b"pecked")]
)
def test_what_is_left_of_a_record_after_a_power_cut_is_nothing(damage: Any) -> None:
    store = remembered()
    store.records = {name: damage(record) for name, record in store.records.items()}
    line = parameter_line(store=store)
    line.until(lambda: complete(line))
    assert not any(one.hash and not one.verified for one in line.reported(ParameterCache))


def test_nothing_is_saved_while_it_is_armed() -> None:
    store = MemoryStore()
    line = parameter_line(store=store, armed=True)
    line.until(lambda: complete(line))
    line.run(20.0)
    assert store.records == {}
    line.around_options["armed"] = False
    line.run(0.1)
    assert store.records


def test_a_reboot_reads_anew_and_the_table_counts_as_remembered_until_then() -> None:
    line = parameter_line()
    line.until(lambda: complete(line))
    line.run(1.0)
    line.reports.clear()
    line.server.parameters.set("RTL_ALT", 1234.0)
    line.comes()
    line.run(0.6)
    assert [one.verified for one in line.reported(ParameterCache)] == [False]
    line.until(lambda: complete(line))
    assert line.reported(ParameterChanged)[-1].name == "RTL_ALT"


def test_a_chip_that_is_told_late_is_another_autopilot() -> None:
    store = remembered()
    line = parameter_line(store=store)
    line.until(lambda: line.reported(ParameterCache))
    line.say(version(uid=5))
    line.run(0.3)
    line.handler.resend()
    line.run(0.3)
    assert line.reported(ParameterCache)[-1].hash is None
    line.until(lambda: complete(line))


def test_a_remembered_table_with_one_too_many_becomes_another() -> None:
    store = remembered()
    line = parameter_line(store=store)
    line.server.parameters._ordered.pop()
    line.server.parameters.set("RTL_ALT", 1234.0)
    line.until(lambda: complete(line))
    assert not line.reported(ParameterChanged)
    assert line.reported(ParameterCache)[-1].hash == table_hash(table_of(line))


@pytest.mark.parametrize("nothing", [Remembered((), 5), Remembered((Row("A", 1.0, 9),), 0)], ids=["empty", "of none"])
def test_a_record_of_nothing_is_none(nothing: Remembered) -> None:
    store = MemoryStore()
    remember(store, "px4-1", nothing)
    assert recall(store, "px4-1") is None
