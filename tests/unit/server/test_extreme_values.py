"""Whatever a vehicle or a pilot's program sends: no link ends, nothing is raised or logged as an error, and everybody
can read what agent and tower make of it."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import zip_longest

import pytest
import structlog
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from vehicle_to_browser import ONE, VehicleToBrowser
from worlds.extreme_frames import (
    EVERY_MESSAGE,
    events_of_px4,
    extreme_frames,
    extremes,
    frame_of,
    frame_of_version_1,
    messages_read,
)
from worlds.tiers import examples

from wire.dialect import mavlink
from wire.frames import message_id, payload, source

PARTS = 6
REST = sorted(set(EVERY_MESSAGE) - set(messages_read()))
M = mavlink
OF_THE_SIMULATOR = sorted(
    one.id
    for one in (
        *(M.MAVLink_heartbeat_message, M.MAVLink_sys_status_message, M.MAVLink_gps_raw_int_message),
        *(M.MAVLink_attitude_message, M.MAVLink_global_position_int_message, M.MAVLink_rc_channels_message),
        *(M.MAVLink_vfr_hud_message, M.MAVLink_command_ack_message, M.MAVLink_battery_status_message),
        *(M.MAVLink_home_position_message, M.MAVLink_ekf_status_report_message, M.MAVLink_vibration_message),
        *(M.MAVLink_mission_count_message, M.MAVLink_mission_item_int_message, M.MAVLink_mission_ack_message),
        *(M.MAVLink_mission_current_message, M.MAVLink_mission_request_message, M.MAVLink_param_value_message),
        *(M.MAVLink_log_entry_message, M.MAVLink_log_data_message, M.MAVLink_file_transfer_protocol_message),
        *(M.MAVLink_autopilot_version_message, M.MAVLink_statustext_message, M.MAVLink_extended_sys_state_message),
        *(M.MAVLink_fence_status_message, M.MAVLink_timesync_message, M.MAVLink_system_time_message),
    )
)


@contextmanager
def no_errors(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    """Neither logging nor structlog is told of an error."""
    caplog.clear()
    with structlog.testing.capture_logs() as logged:
        yield
    errors = [one.getMessage() for one in caplog.records if one.levelno >= logging.ERROR or one.exc_info]
    errors += [str(one) for one in logged if one["log_level"] in ("error", "critical") or one.get("exc_info")]
    assert errors == []


@pytest.fixture(scope="module")
def flying() -> VehicleToBrowser:
    world = VehicleToBrowser()
    world.fly()
    return world


def sweep(world: VehicleToBrowser, numbers: Sequence[int]) -> None:
    """Each extreme value of each field of these messages, from the autopilot in both versions and from the pilot's
    program. In each round every message has one of its own."""
    for round_ in zip_longest(*(extremes(number) for number in numbers)):
        sent = [(number, *one) for number, one in zip(numbers, round_, strict=True) if one is not None]
        try:
            world.say(*(frame_of(number, body) for number, _, body in sent))
            world.pilot_sends(*(frame_of(number, body, system_id=255, component_id=190) for number, _, body in sent))
            _pass(world)
            world.say(*(frame_of_version_1(number, body) for number, _, body in sent if number < 256))
            _pass(world)
        except Exception as error:
            error.add_note(", ".join(f"{mavlink.mavlink_map[number].msgname} {word}" for number, word, _ in sent))
            raise


def _pass(world: VehicleToBrowser) -> None:
    world.now += 0.5  # the rules of the alerts look twice a second
    world.beat()
    world.tick()


def test_every_field_of_every_message_that_is_read(flying: VehicleToBrowser, caplog: pytest.LogCaptureFixture) -> None:
    with no_errors(caplog):
        for part in range(PARTS):
            flying.work()
            sweep(flying, messages_read()[part::PARTS])
            flying.check()
    assert flying.told
    assert flying.reported


@pytest.mark.long("messages that nobody reads")
def test_every_field_of_every_other_message(flying: VehicleToBrowser, caplog: pytest.LogCaptureFixture) -> None:
    with no_errors(caplog):
        for part in range(PARTS):
            sweep(flying, REST[part::PARTS])
            flying.check()


def test_the_messages_that_are_read_are_found_in_the_code() -> None:
    names = {mavlink.mavlink_map[number].msgname for number in messages_read()}
    assert {"HEARTBEAT", "GLOBAL_POSITION_INT", "MISSION_ITEM_INT", "ADSB_VEHICLE", "STATUSTEXT"} <= names
    assert len(names) > 80


any_frames = st.lists(
    st.one_of(
        extreme_frames(st.sampled_from(messages_read())),
        extreme_frames(st.sampled_from(EVERY_MESSAGE)),
        events_of_px4(),
    ),
    max_size=20,
)


@given(frames=any_frames, from_pilot=any_frames)
@settings(
    max_examples=examples(25, long=1000),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
def test_any_frames_from_the_vehicle_and_from_its_pilot(
    flying: VehicleToBrowser, caplog: pytest.LogCaptureFixture, frames: list[bytes], from_pilot: list[bytes]
) -> None:
    with no_errors(caplog):
        for frame in frames:
            flying.say(frame)
            flying.now += 0.3
            flying.beat()
            flying.tick()
        for frame in from_pilot:
            flying.pilot_sends(frame)
            flying.now += 0.3
            flying.tick()
        flying.beat()
        flying.check()


@given(
    number=st.sampled_from(OF_THE_SIMULATOR),
    chosen=st.integers(min_value=0),
    on_the_ground=st.booleans(),
)
@settings(
    max_examples=examples(5, long=600),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
def test_a_vehicle_that_sends_one_wrong_value_throughout_a_flight(
    caplog: pytest.LogCaptureFixture, number: int, chosen: int, on_the_ground: bool
) -> None:
    """All that it answers has it too: while plans, parameters and logs are read and commands are given."""
    payloads = [body for _, body in extremes(number)]
    wrong = payloads[chosen % len(payloads)]

    def replaced(frame: bytes) -> bytes:
        if message_id(frame) != number:
            return frame
        system_id, component_id = source(frame)
        return frame_of(number, wrong, system_id=system_id, component_id=component_id)

    with no_errors(caplog):
        world = VehicleToBrowser()
        if not on_the_ground:
            world.fly()
        world.replaced = replaced
        for _ in range(4):
            world.work()
            world.pass_time(2.0)
        world.check()
    assert payload(frame_of(number, wrong)) == wrong
    assert world.hub.state.drones[ONE].link is world.end.link
