"""The camera and the gimbal beside the autopilot: heartbeats, responses and their content."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from simulator.dialect import mavlink
from simulator.payload_camera import PHOTO_MIB, STORAGE_MIB

ASK = mavlink.MAV_CMD_REQUEST_MESSAGE
CAMERA, GIMBAL = 100, 154
ACCEPTED, DENIED, FAILED = 0, 2, 4
INFORMATION, SETTINGS, STORAGE, CAPTURE, STREAM, STREAM_STATUS = 259, 260, 261, 262, 269, 270
MANAGER, MANAGER_STATUS, DEVICE, ATTITUDE = 280, 281, 283, 285


def answer(ground: Any, component: int, message_id: int) -> Any:
    """Returns the requested message from that component, after its acknowledgement."""
    before = len(ground.heard)
    assert ground.command(ASK, message_id, to=(1, component)) == ACCEPTED
    name = mavlink.mavlink_map[message_id].msgname
    heard = [m for _, m in ground.heard[before:] if m.get_srcComponent() == component]
    acknowledged = next(i for i, m in enumerate(heard) if m.get_type() == "COMMAND_ACK")
    return next(m for m in heard[acknowledged:] if m.get_type() == name)


def heartbeats(ground: Any) -> dict[int, int]:
    """Returns the MAV_TYPE of each component."""
    return {m.get_srcComponent(): m.type for m in ground.of("HEARTBEAT")}


def test_by_itself_there_is_the_autopilot_alone(ground: Callable[..., Any]) -> None:
    station = ground()
    station.run(3.0)
    assert list(heartbeats(station)) == [1]
    for message_id in (INFORMATION, MANAGER, STREAM):
        assert station.command(ASK, message_id) == FAILED


def test_each_component_has_a_heartbeat_that_is_no_autopilots(ground: Callable[..., Any]) -> None:
    station = ground(camera=True, gimbal=True)
    station.run(5.0)
    assert heartbeats(station) == {1: 2, CAMERA: mavlink.MAV_TYPE_CAMERA, GIMBAL: mavlink.MAV_TYPE_GIMBAL}
    of_camera = [m for m in station.of("HEARTBEAT") if m.get_srcComponent() == CAMERA]
    assert {m.autopilot for m in of_camera} == {mavlink.MAV_AUTOPILOT_INVALID}
    assert 4 <= len(of_camera) <= 6
    sequences = [m.get_seq() for m in of_camera]
    assert sequences == list(range(len(sequences))), "it counts its own frames"


def test_a_camera_says_what_it_is_and_what_it_has(ground: Callable[..., Any]) -> None:
    station = ground(camera=True, gimbal=True)
    camera = answer(station, CAMERA, INFORMATION)
    assert bytes(camera.vendor_name).rstrip(b"\0") == b"tower-sim"
    can = mavlink.CAMERA_CAP_FLAGS_CAPTURE_IMAGE | mavlink.CAMERA_CAP_FLAGS_CAPTURE_VIDEO
    assert camera.flags == can | mavlink.CAMERA_CAP_FLAGS_HAS_BASIC_ZOOM
    assert (camera.resolution_h, camera.resolution_v) == (4000, 3000)
    field_of_view = 2 * math.degrees(math.atan(camera.sensor_size_h / 2 / camera.focal_length))
    assert field_of_view == pytest.approx(75.0, abs=0.01)
    assert camera.gimbal_device_id == GIMBAL
    assert answer(station, CAMERA, SETTINGS).mode_id == mavlink.CAMERA_MODE_IMAGE
    storage = answer(station, CAMERA, STORAGE)
    assert (storage.storage_count, storage.status) == (1, mavlink.STORAGE_STATUS_READY)
    assert storage.used_capacity + storage.available_capacity == storage.total_capacity == STORAGE_MIB
    assert station.command(ASK, STREAM, to=(1, CAMERA)) == FAILED, "it films nothing"
    assert answer(ground(camera=True), CAMERA, INFORMATION).gimbal_device_id == 0


def test_what_it_captures_shows(ground: Callable[..., Any]) -> None:
    station = ground(camera=True).ready()
    assert answer(station, CAMERA, CAPTURE).image_status == 0
    start = mavlink.MAV_CMD_IMAGE_START_CAPTURE
    assert station.command(start, 0, 2, 3, 1, to=(1, CAMERA)) == ACCEPTED
    status = answer(station, CAMERA, CAPTURE)
    assert (status.image_status, status.image_interval) == (2, 2.0)
    station.run(8.0)
    status = answer(station, CAMERA, CAPTURE)
    assert (status.image_status, status.image_count) == (0, 3)
    assert (
        status.available_capacity == answer(station, CAMERA, STORAGE).available_capacity == STORAGE_MIB - 3 * PHOTO_MIB
    )
    assert station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1, to=(1, CAMERA)) == 3, "that is the autopilot's"
    assert not station.flight.armed


def test_a_camera_that_films_says_where(ground: Callable[..., Any]) -> None:
    station = ground(camera=True)
    station.vehicle.films_at("http://127.0.0.1:8080/camera")
    assert answer(station, CAMERA, INFORMATION).flags & mavlink.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM
    stream = answer(station, CAMERA, STREAM)
    assert (stream.stream_id, stream.count, stream.uri) == (1, 1, "http://127.0.0.1:8080/camera")
    status = answer(station, CAMERA, STREAM_STATUS)
    assert (status.resolution_h, status.resolution_v, status.framerate) == (640, 480, 30.0)
    assert (stream.resolution_h, stream.hfov) == (status.resolution_h, status.hfov)


@pytest.mark.parametrize(
    ("command", "message_id"), [(521, INFORMATION), (522, SETTINGS), (525, STORAGE), (527, CAPTURE), (2504, STREAM)]
)
def test_the_older_requests_are_answered_as_well(ground: Callable[..., Any], command: int, message_id: int) -> None:
    station = ground(camera=True)
    station.vehicle.films_at("http://127.0.0.1:8080/camera")
    assert station.command(command, 1, to=(1, CAMERA)) == ACCEPTED
    assert len(station.of(mavlink.mavlink_map[message_id].msgname)) == 1


def test_the_manager_of_the_gimbal_is_the_autopilot(ground: Callable[..., Any]) -> None:
    station = ground(gimbal=True)
    manager = answer(station, 1, MANAGER)
    assert (manager.gimbal_device_id, manager.cap_flags) == (GIMBAL, answer(station, GIMBAL, DEVICE).cap_flags)
    assert math.degrees(manager.pitch_min) == pytest.approx(-90.0)
    assert answer(station, 1, MANAGER_STATUS).primary_control_sysid == 0
    assert station.command(ASK, MANAGER, to=(1, GIMBAL)) == FAILED


def test_it_turns_for_whoever_has_the_control_of_it(ground: Callable[..., Any]) -> None:
    station = ground(gimbal=True)
    turn, configure = mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
    assert station.command(turn, -45, 90) == DENIED
    assert station.command(configure, -2, -2) == ACCEPTED
    status = answer(station, 1, MANAGER_STATUS)
    assert (status.primary_control_sysid, status.primary_control_compid) == (255, 190)
    assert station.command(turn, -45, 90) == ACCEPTED
    station.run(0.5)
    on_the_way = pitch_and_yaw(answer(station, GIMBAL, ATTITUDE))
    assert -45.0 < on_the_way[0] < -20.0
    station.run(3.0)
    attitude = answer(station, GIMBAL, ATTITUDE)
    assert pitch_and_yaw(attitude) == pytest.approx((-45.0, 90.0), abs=0.01)
    assert attitude.flags & mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
    streamed = [m for m in station.of("GIMBAL_DEVICE_ATTITUDE_STATUS") if m.get_srcComponent() == GIMBAL]
    assert len(streamed) > 15, "five a second"
    assert station.command(configure, -3, -3) == ACCEPTED
    assert station.command(turn, 0, 0) == DENIED


def pitch_and_yaw(attitude: Any) -> tuple[float, float]:
    """Returns degrees, of a quaternion without roll."""
    w, x, y, z = attitude.q
    assert math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)) == pytest.approx(0.0, abs=1e-6)
    pitch, yaw = math.asin(2 * (w * y - z * x)), math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return math.degrees(pitch), math.degrees(yaw)


def test_the_camera_zooms_records_and_refuses_what_it_cannot(ground):
    station = ground(camera=True).ready()
    settings, status = 260, 262

    def report(number, name):
        station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, number, to=(1, 100))
        return station.of(name)[-1]

    assert station.command(mavlink.MAV_CMD_SET_CAMERA_ZOOM, 2, 40, to=(1, 100)) == 0
    assert report(settings, "CAMERA_SETTINGS").zoomLevel == 40
    assert station.command(mavlink.MAV_CMD_SET_CAMERA_ZOOM, 1, -1, to=(1, 100)) == 0
    station.run(2)
    assert report(settings, "CAMERA_SETTINGS").zoomLevel == 0
    for params in ((2, 101), (0, 1), (1, 7)):
        assert station.command(mavlink.MAV_CMD_SET_CAMERA_ZOOM, *params, to=(1, 100)) == 2
    assert station.command(mavlink.MAV_CMD_VIDEO_START_CAPTURE, 0, to=(1, 100)) == 0
    station.run(1)
    assert report(status, "CAMERA_CAPTURE_STATUS").video_status == 1
    assert report(status, "CAMERA_CAPTURE_STATUS").recording_time_ms > 900
    assert station.command(mavlink.MAV_CMD_VIDEO_STOP_CAPTURE, 0, to=(1, 100)) == 0
    assert report(status, "CAMERA_CAPTURE_STATUS").video_status == 0


def test_a_locked_gimbal_keeps_its_direction_when_the_nose_turns(ground):
    station = ground(gimbal=True, heading_deg=90).ready()
    station.command(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, -2, -2, -1, -1)
    assert station.command(mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, -30, 135, 0, 0, 16) == 0
    station.run(3)
    gimbal = station.vehicle.components.gimbal
    assert (round(gimbal.pitch_deg), round(gimbal.yaw_deg)) == (-30, 45)
    station.flight.body.turn_to(0.0)
    station.run(3)
    assert round(gimbal.yaw_deg) == 135
