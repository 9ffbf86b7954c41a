"""One vehicle counts on a line that several share."""

from typing import Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wire.dialect import build, mavlink
from wire.own_system import OTHER_FOR_S, SILENT_S, OwnSystem, target_system


def sent(message: Any, system: int = 1, component: int = 1) -> bytes:
    return build(message, system_id=system, component_id=component, sequence=0)


def beat(system: int, component: int = 1, *, kind: int = 3, vehicle: int = 2) -> bytes:
    return sent(mavlink.MAVLink_heartbeat_message(vehicle, kind, 1, 5, 4, 3), system, component)


def place(system: int, component: int = 1) -> bytes:
    return sent(mavlink.MAVLink_global_position_int_message(1, 2, 3, 4, 5, 6, 7, 8, 9), system, component)


RADIO: Final = sent(mavlink.MAVLink_radio_status_message(1, 2, 3, 4, 5, 6, 7), 51, 68)


def found(system: int = 1, **options: Any) -> OwnSystem:
    own = OwnSystem(**options)
    assert own.counts(beat(system), 10.0)
    return own


def test_the_first_autopilot_is_the_drone() -> None:
    own = OwnSystem()
    assert not own.counts(place(1), 1.0), "nobody knows yet whose place it is"
    for stranger in (beat(255, 190, kind=8, vehicle=6), beat(1, 191, kind=8, vehicle=18), beat(255, 1, vehicle=6)):
        own.counts(stranger, 1.0)
    assert own.system_id is None
    assert own.counts(beat(3), 2.0)
    assert own.counts(place(3), 2.0)
    assert own.system_id == 3


def test_what_an_agent_has_judged_needs_no_heartbeat() -> None:
    own = OwnSystem(judged=True)
    assert own.counts(place(4, component=154), 1.0)
    assert own.counts(place(4), 1.0)
    assert not own.counts(place(5), 1.0)


def test_another_vehicle_never_counts_however_long_the_own_one_is_silent() -> None:
    own = found()
    assert not own.counts(beat(2), 10.5)
    assert own.counts(beat(1), 11.0)
    assert own.others(11.0) == (2,)
    for later_s in range(60):
        assert not own.counts(beat(2), 11.0 + later_s)
        assert not own.counts(place(2), 11.0 + later_s)
    assert own.system_id == 1


def test_a_changed_system_id_counts_after_a_silence() -> None:
    own = found()
    for at in (10.5, 11.5, 10.0 + SILENT_S - 0.01):
        assert not own.counts(beat(7), at)
        assert own.others(at) == (), "one that follows the own one is no second one"
    assert own.counts(beat(7), 10.0 + SILENT_S)
    assert not own.counts(place(1), 16.0)


def test_an_agent_that_starts_again_waits_for_its_own_vehicle() -> None:
    own = OwnSystem(remembered=2, now=100.0)
    assert not own.counts(beat(1), 100.5)
    assert own.counts(beat(2), 101.0)
    assert own.system_id == 2
    gone = OwnSystem(remembered=2, now=100.0)
    assert not gone.counts(beat(1), 100.5)
    assert gone.counts(beat(1), 100.0 + SILENT_S)


def test_a_given_system_is_the_only_one() -> None:
    own = OwnSystem(only=2)
    for later_s in range(30):
        assert not own.counts(beat(1), float(later_s))
    assert own.counts(beat(2), 31.0)


def test_others_are_forgotten() -> None:
    own = found()
    own.counts(beat(2), 10.5)
    own.counts(beat(1), 11.0)
    assert own.others(10.4 + OTHER_FOR_S) == (2,)
    assert own.others(10.6 + OTHER_FOR_S) == ()


def test_radios_cameras_and_gimbals_count_and_a_place_of_a_companion_does_not() -> None:
    own = found()
    assert own.counts(RADIO, 11.0)
    assert own.counts(beat(1, 100, kind=8, vehicle=30), 11.0)
    assert own.counts(sent(mavlink.MAVLink_camera_capture_status_message(1, 0, 0, 0, 0, 0), 1, 100), 11.0)
    assert not own.counts(place(1, 191), 11.0)


def test_what_may_go_to_the_drone() -> None:
    own = found()
    to = {
        system: sent(mavlink.MAVLink_command_long_message(system, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0), 255, 190)
        for system in (0, 1, 2)
    }
    no_addressee = sent(mavlink.MAVLink_gps_rtcm_data_message(0, 1, [0] * 180), 255, 190)
    assert own.may_take(no_addressee, 11.0)
    assert [own.may_take(to[system], 11.0) for system in (0, 1, 2)] == [True, True, False]
    own.counts(beat(2), 10.5)
    own.counts(beat(1), 11.0)
    assert [own.may_take(to[system], 11.0) for system in (0, 1, 2)] == [False, True, False]
    own.told(1, (2,))
    assert not own.may_take(to[0], 1000.0)
    own.told(1, ())
    assert own.may_take(to[0], 1000.0)


@pytest.mark.parametrize("message", mavlink.mavlink_map.values(), ids=lambda one: one.msgname)
def test_the_addressee_is_where_the_dialect_packs_it(message: Any) -> None:
    values: dict[str, Any] = {}
    for name, kind, count in zip(message.fieldnames, message.fieldtypes, _counts(message), strict=True):
        values[name] = b"" if kind == "char" and count else [0] * count if count else b"\0" if kind == "char" else 0
    addressee = next((name for name in ("target_system", "target") if name in message.fieldnames), None)
    if addressee is None:
        assert target_system(sent(message(**values))) is None
        return
    assert target_system(sent(message(**values))) == 0
    assert target_system(sent(message(**(values | {addressee: 77})))) == 77


def _counts(message: Any) -> list[int]:
    by_name = dict(zip(message.ordered_fieldnames, message.array_lengths, strict=True))
    return [by_name[name] for name in message.fieldnames]


FRAMES = st.tuples(st.sampled_from((1, 2, 3)), st.sampled_from((beat, place)), st.sampled_from((1, 1, 191)))


@given(st.lists(st.tuples(st.floats(0.0, 2.0), FRAMES), max_size=60))
def test_whatever_the_order_only_one_vehicle_counts_while_it_is_heard(story: list[Any]) -> None:
    own, now, heard_at = OwnSystem(), 0.0, 0.0
    for pause_s, (system, kind, component) in story:
        now += pause_s
        before = own.system_id
        if own.counts(kind(system, component), now):
            assert system == own.system_id
            if own.system_id != before:
                assert before is None or now - heard_at >= SILENT_S
            heard_at = now if component == 1 else heard_at
