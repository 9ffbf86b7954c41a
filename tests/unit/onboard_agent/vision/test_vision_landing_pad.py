"""A pad of several markers in pictures of the simulator's camera: where it says the place to touch down is."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from onboard_agent.unusable import Unusable
from onboard_agent.vision.camera_model import Attitude, CameraModel, Mounting, applied
from onboard_agent.vision.landing_pad import PadFinder
from onboard_agent.vision.pad_setting import PadMarker, PadSetting, parse_pad_setting
from simulator.camera.pads import USUAL_MARKERS, LandingPad, draw_pads, parse_pad
from simulator.camera.view import EYE_HEIGHT_M, FIELD_OF_VIEW_DEG, View, pose_of

CAMERA = CameraModel(640, 480, FIELD_OF_VIEW_DEG, Mounting(tilt_deg=90.0))
MARKERS = tuple(PadMarker(one.number, one.side_m, one.right_m, one.up_m) for one in USUAL_MARKERS)
FINDER = PadFinder(MARKERS, "aruco-4x4-50", CAMERA)


def picture_of(pad, north_m, east_m, height_m, roll=0.0, pitch=0.0, yaw=0.0):
    view = View(pose_of(north_m, east_m, height_m, roll, pitch, yaw), 640, 480, 90.0)
    picture = np.full((480, 640, 3), (90, 110, 100), np.uint8)
    draw_pads(picture, view, [pad])
    return picture


def world_of(body_m, roll, pitch, yaw):
    return applied(Attitude(*map(math.radians, (roll, pitch, yaw))).world_from_body(), body_m)


@pytest.mark.parametrize("height_m", [0.3, 0.8, 1.5, 3.0, 6.0, 10.0])
def test_the_place_is_right_from_every_height(height_m: float) -> None:
    source = random.Random(f"heights {height_m}")
    for _ in range(6):
        roll, pitch = (source.uniform(-8, 8) for _ in range(2))
        yaw, heading = (source.uniform(0, 360) for _ in range(2))
        pad = LandingPad(3.0, -2.0, heading)
        north, east = (source.uniform(-0.04, 0.04) * (height_m + EYE_HEIGHT_M) for _ in range(2))
        sighting = FINDER.look(picture_of(pad, 3.0 + north, -2.0 + east, height_m, roll, pitch, yaw))
        assert sighting is not None
        found = world_of(sighting.body_m, roll, pitch, yaw)
        lens_m = height_m + EYE_HEIGHT_M
        assert math.hypot(found[0] + north, found[1] + east) < 0.01 + 0.012 * lens_m
        assert found[2] == pytest.approx(lens_m, rel=0.03)
        turned = (math.degrees(sighting.yaw_rad) - (heading - yaw) + 180.0) % 360.0 - 180.0
        assert abs(turned) < 6.0


def test_the_large_marker_is_for_far_and_the_small_one_for_near() -> None:
    pad = LandingPad(0.0, 0.0)
    far, near = (FINDER.look(picture_of(pad, 0.0, 0.0, height)) for height in (8.0, 0.4))
    assert far is not None and near is not None
    assert (far.number, near.number) == (0, 1)


def test_no_pad_and_a_foreign_marker_are_nothing() -> None:
    assert FINDER.look(np.full((480, 640, 3), 120, np.uint8)) is None
    stranger = LandingPad(0.0, 0.0, 0.0, (type(USUAL_MARKERS[0])(9, 1.0),))
    assert FINDER.look(picture_of(stranger, 0.0, 0.0, 5.0)) is None


def test_a_camera_beside_the_middle_is_counted() -> None:
    camera = CameraModel(640, 480, FIELD_OF_VIEW_DEG, Mounting(90.0, forward_m=0.2, right_m=-0.1, down_m=0.05))
    picture = picture_of(LandingPad(0.0, 0.0), 0.0, 0.0, 4.0)
    here, there = FINDER.look(picture), PadFinder(MARKERS, "aruco-4x4-50", camera).look(picture)
    assert here is not None and there is not None
    assert there.body_m == pytest.approx([a + b for a, b in zip(here.body_m, (0.2, -0.1, 0.05), strict=True)])


def test_the_message_has_place_distance_and_time() -> None:
    sighting = FINDER.look(picture_of(LandingPad(0.0, 0.0), 0.0, 0.0, 5.0))
    assert sighting is not None
    message = sighting.message(77)
    assert message is not None
    assert (message.time_usec, message.position_valid, message.frame, message.type) == (77, 1, 12, 2)
    assert message.distance == pytest.approx(math.hypot(message.x, message.y, message.z))


def test_the_setting_is_read() -> None:
    setting = parse_pad_setting(
        "aruco-4x4-50:0=1.0@0,0.85;1=0.16", "http://127.0.0.1:8090/camera?tilt=90#fov=75&tilt=90"
    )
    assert setting == PadSetting(
        "aruco-4x4-50",
        (PadMarker(0, 1.0, 0.0, 0.85), PadMarker(1, 0.16)),
        "http://127.0.0.1:8090/camera?tilt=90",
        (("fov", 75.0), ("tilt", 90.0)),
    )


@pytest.mark.parametrize(
    ("pad", "camera"),
    [
        ("aruco-4x4-50", "v4l2:/dev/video0"),
        ("aruco-4x4-50:0=1;0=2", "v4l2:/dev/video0"),
        ("aruco-4x4-50:300=1", "v4l2:/dev/video0"),
        ("aruco-4x4-50:1=0", "v4l2:/dev/video0"),
        ("aruco-4x4-50:1=nan", "v4l2:/dev/video0"),
        ("aruco-4x4-50:1=1@2", "v4l2:/dev/video0"),
        ("aruco-4x4-50:1=1", ""),
        ("aruco-4x4-50:1=1", "v4l2:/dev/video0#fov=200"),
        ("aruco-4x4-50:1=1", "v4l2:/dev/video0#zoom=2"),
    ],
)
def test_what_is_no_setting_is_said(pad: str, camera: str) -> None:
    with pytest.raises(Unusable, match="landing_"):
        parse_pad_setting(pad, camera)


def test_a_pad_of_the_simulator_is_read() -> None:
    assert parse_pad("47.1,8.2") == (47.1, 8.2, 0.0)
    assert parse_pad("47.1,8.2,90") == (47.1, 8.2, 90.0)
    for wrong in ("47.1", "91,8", "47,8,nan", "a,b"):
        with pytest.raises(ValueError, match=r"LAT,LON|no such place"):
            parse_pad(wrong)
