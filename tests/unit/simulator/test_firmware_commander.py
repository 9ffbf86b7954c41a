"""The state machine has no gap, and the commander alone arms, reports and recovers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.firmware.commander import RECOVERED_AFTER_S, Commander, RequestRefused
from simulator.firmware.health import (
    Health,
    Sensor,
    Weight,
    check_init,
    check_run_auto,
    check_run_manual,
    check_startup,
)
from simulator.firmware.states import FLYING, TABLE, Event, Refusal, SystemState, after

READY = Health(attitude_known=True, position_known=True, gps_fix=True)


def safe() -> Commander:
    commander = Commander(replace(READY))
    commander.update(0.0)
    commander.update(0.1)
    assert commander.state is SystemState.SAFE
    return commander


def in_auto() -> Commander:
    commander = safe()
    commander.auto()
    return commander


def texts(commander: Commander) -> list[str]:
    return [notice.text for notice in commander.texts]


def test_the_table_has_every_pair_of_state_and_event() -> None:
    assert set(TABLE) == set(product(SystemState, Event))


@given(st.lists(st.sampled_from(Event), max_size=40))
def test_any_sequence_of_events_stays_within_the_rules(events: list[Event]) -> None:
    state = SystemState.INIT
    for event in events:
        outcome = after(state, event)
        if isinstance(outcome, Refusal):
            assert outcome.reason
            continue
        if outcome in FLYING and state not in FLYING:
            # Motors start only from SYS_SAFE on a request; a major fault is FAIL_MAJOR in every state.
            assert event is Event.MAJOR_FAULT or (
                state is SystemState.SAFE and event in (Event.AUTO_REQUESTED, Event.MANUAL_REQUESTED)
            )
        if event is Event.MAJOR_FAULT:
            assert outcome is SystemState.FAIL_MAJOR
        if state is SystemState.FAIL_MAJOR:
            assert outcome in (SystemState.FAIL_MAJOR, SystemState.SAFE), "a major fault leads to SYS_SAFE only"
        state = outcome


def test_every_state_can_be_reached_and_left() -> None:
    for state in SystemState:
        outcomes = {o for (_, _), o in TABLE.items() if isinstance(o, SystemState)}
        assert state in outcomes
        assert any(isinstance(after(state, e), SystemState) and after(state, e) is not state for e in Event)


def test_the_start_goes_through_init_and_startup_to_safe() -> None:
    commander = Commander(Health(present=frozenset(Sensor) - {Sensor.GPS}))
    commander.update(0.0)
    assert (commander.state, texts(commander)) == (SystemState.INIT, ["GPS not found"])
    commander.health.present = frozenset(Sensor)
    commander.update(0.1)
    commander.update(0.2)
    assert commander.state is SystemState.STARTUP
    assert texts(commander)[-1] == "Attitude unknown"
    commander.health.attitude_known = True
    commander.update(0.3)
    assert commander.state is SystemState.SAFE


@pytest.mark.parametrize(
    ("check", "change", "text"),
    [
        (check_init, {"present": frozenset(Sensor) - {Sensor.COMPASS}}, "Compass not found"),
        (check_init, {"outputs": False}, "Motor outputs not found"),
        (check_startup, {"calibrated": frozenset(Sensor) - {Sensor.COMPASS}}, "Compass not calibrated"),
        (check_startup, {"tasks_running": False}, "Control tasks not running"),
        (check_startup, {"attitude_known": False}, "Attitude unknown"),
        (check_run_manual, {"radio": False}, "Radio lost"),
        (check_run_auto, {"gps_fix": False}, "GPS lost"),
        (check_run_auto, {"gps_believed": False}, "GPS glitch"),
        (check_run_auto, {"position_known": False}, "Position unknown"),
        (check_run_auto, {"mavlink_required": True, "mavlink_in": False}, "MAVLink lost"),
        (check_run_auto, {"mavlink_required": True, "mavlink_out": False}, "MAVLink lost"),
        (check_run_auto, {"in_place": False}, "Blown away"),
        (check_run_manual, {"motors": False}, "Motor failure"),
        (check_run_auto, {"battery_flat": True}, "Battery empty"),
        (check_run_auto, {"battery_volts_ok": False}, "Battery voltage low"),
        (check_run_manual, {"compass_believed": False}, "Compass inconsistent"),
        (check_run_auto, {"barometer_moving": False}, "Barometer stuck"),
        (check_run_auto, {"vibration_low": False}, "Vibration high"),
    ],
)
def test_each_check_tests_its_own_group(
    check: Callable[[Health], list[object]], change: dict[str, object], text: str
) -> None:
    assert check(READY) == []
    assert [getattr(f, "text", "") for f in check(replace(READY, **change))] == [text]  # type: ignore[arg-type]


def test_manual_flight_needs_no_position_and_auto_flight_no_radio() -> None:
    assert check_run_manual(replace(READY, gps_fix=False, position_known=False)) == []
    assert check_run_auto(replace(READY, radio=False)) == []
    assert check_run_manual(replace(READY, radio=False, radio_required=False)) == []


def test_arming_only_from_safe_and_only_when_every_check_passes() -> None:
    with pytest.raises(RequestRefused, match="not ready"):
        Commander(replace(READY)).auto()
    commander = safe()
    commander.health.gps_fix = False
    with pytest.raises(RequestRefused, match="GPS lost"):
        commander.auto()
    assert not commander.health.armed
    commander.run_manual()
    assert commander.health.armed
    assert commander.state is SystemState.RUN_MANUAL
    with pytest.raises(RequestRefused, match="stop first"):
        commander.reset()
    commander.stop()
    assert (commander.state, commander.health.armed) == (SystemState.SAFE, False)
    commander.reset()
    assert commander.state is SystemState.INIT


def test_a_minor_fault_is_said_once_and_recovered_from() -> None:
    commander = in_auto()
    commander.health.gps_fix = False
    for i in range(10):
        commander.update(1.0 + 0.1 * i)
    assert commander.state is SystemState.FAIL_MINOR
    assert commander.health.armed
    assert texts(commander).count("GPS lost") == 1
    commander.health.gps_fix = True
    commander.update(3.0)
    commander.health.gps_fix = False  # it comes and goes
    commander.update(3.0 + RECOVERED_AFTER_S)
    assert commander.state is SystemState.FAIL_MINOR
    commander.health.gps_fix = True
    commander.update(5.0)
    commander.update(5.0 + RECOVERED_AFTER_S)
    assert commander.state is SystemState.RUN_AUTO
    assert texts(commander)[-2:] == ["Recovered", "SYS_RUN_AUTO"]


def test_a_minor_fault_goes_back_to_what_flew_before() -> None:
    commander = safe()
    commander.run_manual()
    commander.health.compass_believed = False
    commander.update(1.0)
    assert commander.state is SystemState.FAIL_MINOR
    commander.health.compass_believed = True
    commander.update(2.0)
    commander.update(3.1)
    assert commander.state is SystemState.RUN_MANUAL


def test_a_major_fault_ends_in_safe_and_nothing_else() -> None:
    commander = in_auto()
    commander.health.motors = False
    commander.update(1.0)
    assert commander.state is SystemState.FAIL_MAJOR
    assert commander.faults[0].weight is Weight.MAJOR
    with pytest.raises(RequestRefused, match="major fault"):
        commander.run_manual()
    commander.health.motors = True
    commander.update(2.0)
    commander.update(9.0)
    assert commander.state is SystemState.FAIL_MAJOR
    commander.motors_stopped()
    assert (commander.state, commander.health.armed) == (SystemState.SAFE, False)


def test_texts_that_nobody_takes_are_bounded() -> None:
    commander = in_auto()
    for i in range(200):
        commander.health.gps_fix = i % 2 == 0
        commander.update(float(i))
    assert len(commander.texts) == 64
