"""Telemetry from frames, events from messages, streams, places and missions."""

import asyncio
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from control_tower.errors import TooSlow
from control_tower.events import AlertChanged, ControlChanged, DroneChanged, HoldStep, OtherEvent, parse
from control_tower.geodesy import distance_m, offset, turned
from control_tower.mission import Mission
from control_tower.streams import MAX_EVENTS, Stream, uninterrupted
from control_tower.telemetry import MAX_VALUES, TelemetryReader
from control_tower.values import User
from wire.dialect import build, mavlink


def frame(message: Any, component: int = 1) -> bytes:
    return build(message, system_id=1, component_id=component, sequence=0)


HEARTBEAT = mavlink.MAVLink_heartbeat_message(2, 3, 0x80, 4, 4, 3)


def test_frames_become_telemetry() -> None:
    reader = TelemetryReader()
    for message in (
        HEARTBEAT,
        mavlink.MAVLink_global_position_int_message(0, 473977000, 85456000, 500_000, 12_500, 150, -50, -20, 9000),
        mavlink.MAVLink_attitude_message(0, 0.1, -0.2, -math.pi / 2, 0, 0, 0),
        mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 15_300, 1250, 71, 0, 0, 0, 0, 0, 0),
        mavlink.MAVLink_gps_raw_int_message(0, 3, 0, 0, 0, 0, 0, 0, 0, 255),
        mavlink.MAVLink_mission_current_message(4),
    ):
        assert reader.take(frame(message), 7.0)
    now = reader.newest
    assert (now.armed, now.mode, now.heard_at_s) == (True, "GUIDED", 7.0)
    assert now.place == (47.3977, 8.5456)
    assert (now.altitude_m, now.height_m, now.heading_deg) == (500.0, 12.5, 90.0)
    assert (now.north_m_s, now.east_m_s, now.down_m_s) == (1.5, -0.5, -0.2)
    assert now.yaw_deg == pytest.approx(270.0)
    assert (now.battery_percent, now.battery_v, now.battery_a) == (71.0, 15.3, 12.5)
    assert (now.gps_fix, now.satellites, now.mission_item) == (3, None, 4)


def test_what_is_unknown_is_none() -> None:
    reader = TelemetryReader()
    reader.take(frame(mavlink.MAVLink_global_position_int_message(0, 0, 0, 0, 0, 0, 0, 0, 65535)), 0.0)
    reader.take(frame(mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 65535, -1, -1, 0, 0, 0, 0, 0, 0)), 0.0)
    now = reader.newest
    assert (now.place, now.heading_deg, now.battery_percent, now.battery_v, now.battery_a) == (None,) * 5


def test_a_gimbal_is_not_the_autopilot_but_a_sensor_beside_it_counts() -> None:
    reader = TelemetryReader()
    assert not reader.take(frame(HEARTBEAT, component=154), 1.0)
    assert reader.newest.armed is None
    assert reader.take(frame(mavlink.MAVLink_named_value_float_message(0, b"co2_ppm", 415.5), component=191), 2.0)
    assert reader.newest.values == {"co2_ppm": 415.5}
    for number in range(MAX_VALUES + 10):
        reader.take(frame(mavlink.MAVLink_named_value_float_message(0, b"v%d" % number, 1.0), component=191), 2.0)
    assert len(reader.newest.values) == MAX_VALUES
    assert not reader.take(b"\xfd\x00 not a frame", 3.0)


def test_texts_are_kept_for_the_caller() -> None:
    reader = TelemetryReader()
    reader.take(frame(mavlink.MAVLink_statustext_message(4, b"PreArm: Compass")), 0.0)
    assert reader.texts == [(4, "PreArm: Compass")]


DRONE = {"id": 3, "name": "Kestrel", "online": True, "holder": {"id": 7, "name": "alice"}, "epoch": 2, "hold": None}


def test_messages_become_events() -> None:
    drone = parse({"type": "drone", "drone": DRONE | {"hold": {"open": True, "detail": "it stays"}}})
    assert isinstance(drone, DroneChanged)
    assert (drone.state.holder, drone.state.hold_open, drone.state.hold_words) == (User(7, "alice"), True, "it stays")
    control = {"drone_id": 3, "event": "taken", "epoch": 3, "holder": None, "by": None, "reason": "r"}
    assert parse({"type": "control"} | control) == ControlChanged(3, "taken", 3, None, None, "r")
    step = {"drone_id": 3, "epoch": 3, "step": "confirmed", "detail": "d", "elapsed_ms": 5, "cause": "order"}
    assert parse({"type": "hold"} | step) == HoldStep(3, 3, "confirmed", "d", "order")
    alert = {"drone_id": 3, "id": 9, "rule": "link-lost", "severity": "critical", "words": "w", "closed_at": None}
    assert parse({"type": "alert", "alert": alert}) == AlertChanged(3, 9, "link-lost", "critical", "w", True)
    unknown = {"type": "of tomorrow", "x": 1}
    assert parse(unknown) == OtherEvent(None, "of tomorrow", unknown)
    with pytest.raises(KeyError):
        parse({"type": "control", "drone_id": 3})


async def test_a_slow_watcher_gets_the_newest_and_a_slow_listener_an_error() -> None:
    watched: Stream[int] = Stream(newest_only=True)
    heard: Stream[int] = Stream(newest_only=False)
    for number in range(MAX_EVENTS + 1):
        watched.put(number)
        heard.put(number)
    assert await anext(watched) == MAX_EVENTS
    assert [await anext(heard) for _ in range(MAX_EVENTS)] == list(range(MAX_EVENTS))
    with pytest.raises(TooSlow):
        await anext(heard)


async def test_nothing_interrupts_the_end_of_a_flight() -> None:
    go_on, done = asyncio.Event(), []

    async def work() -> None:
        await go_on.wait()
        done.append(True)

    task = asyncio.create_task(uninterrupted(work()))
    await asyncio.sleep(0)
    for _ in range(3):
        task.cancel()
        await asyncio.sleep(0)
    assert not task.done()
    go_on.set()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert done == [True]


@given(st.floats(-70, 70), st.floats(-179, 179), st.floats(-5000, 5000), st.floats(-5000, 5000), st.floats(-360, 360))
def test_offsets_have_their_length(lat: float, lon: float, north: float, east: float, by: float) -> None:
    there = offset(lat, lon, north, east)
    assert distance_m(lat, lon, *there) == pytest.approx(math.hypot(north, east), rel=0.005, abs=0.05)
    assert math.hypot(*turned(north, east, by)) == pytest.approx(math.hypot(north, east), abs=1e-6)


def test_a_wedge_turns_clockwise() -> None:
    assert turned(-10, 10, 90) == pytest.approx((-10, -10))


def test_rows_of_a_mission() -> None:
    rows = Mission().take_off(20).speed(5).way_point(47.3977, 8.5456, 30, wait_s=2).servo(9, 1900).return_home().rows
    assert rows[0] == [22, 3, [0, 0, 0, None], 0, 0, 20, 1]
    assert rows[2] == [16, 3, [2, 0, 0, None], 473977000, 85456000, 30, 1]
    assert [row[0] for row in rows] == [22, 178, 16, 183, 20]
    with pytest.raises(ValueError, match="pulse"):
        Mission().servo(9, 90)
