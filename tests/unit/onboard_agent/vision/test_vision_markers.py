"""Markers in pictures of an exact camera, their pose, and the LANDING_TARGET that comes of it."""

from __future__ import annotations

import math
from dataclasses import asdict

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from onboard_agent.vision import landing_target as landing
from onboard_agent.vision.camera_model import CameraModel, Mounting
from onboard_agent.vision.concentric_squares import ConcentricSquareDetector
from onboard_agent.vision.landing_target import NotBelow, landing_target
from onboard_agent.vision.markers import FAMILIES, MarkerDetector
from onboard_agent.vision.square_pose import SquarePose, camera_matrix, square_pose
from simulator.target_pictures.render import render
from wire.dialect import mavlink

SIDE_M = 0.4
CAMERA = CameraModel(640, 480, 70.0)
PLACES = [((0.0, 0.0, 2.0), 0.0, 0.0), ((0.4, -0.3, 2.5), 35.0, 20.0), ((-0.7, 0.4, 4.0), 200.0, -30.0)]
"""In lens axes (right, down, ahead), spin, and tilt about the picture's horizontal, in degrees."""


def seen(
    family: str, number: int, place: tuple[float, float, float], spin_deg: float, tilt_deg: float
) -> npt.NDArray[np.uint8]:
    """A picture of a marker, with a white margin around its black square."""
    px, margin = 400, 60
    sheet = np.full((px + 2 * margin, px + 2 * margin), 255, np.uint8)
    drawn = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(FAMILIES[family]), number, px)
    sheet[margin : margin + px, margin : margin + px] = drawn
    spin = cv2.Rodrigues(np.array([0.0, 0.0, math.radians(spin_deg)]))[0]
    tilt = cv2.Rodrigues(np.array([math.radians(tilt_deg), 0.0, 0.0]))[0]
    rotation = np.asarray(tilt @ spin)
    metre = SIDE_M / px
    offset = -(margin + px / 2 - 0.5) * metre
    to_plane = np.array([[metre, 0, offset], [0, metre, offset], [0, 0, 1.0]])
    to_picture = camera_matrix(CAMERA) @ np.column_stack([rotation[:, 0], rotation[:, 1], place]) @ to_plane
    return np.asarray(
        cv2.warpPerspective(sheet, to_picture, (640, 480), flags=cv2.INTER_AREA, borderValue=110), np.uint8
    )


@pytest.mark.parametrize(("place", "spin_deg", "tilt_deg"), PLACES)
@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_a_marker_is_found_with_its_place(
    family: str, place: tuple[float, float, float], spin_deg: float, tilt_deg: float
) -> None:
    picture = seen(family, 7, place, spin_deg, tilt_deg)
    (marker,) = MarkerDetector(family).find(picture)
    assert marker.number == 7
    right, down, ahead = place
    x, y = CAMERA.middle_px
    truth = (x + CAMERA.focal_px * right / ahead, y + CAMERA.focal_px * down / ahead)
    assert math.dist(marker.centre_px, truth) < 0.6
    pose = marker.pose(SIDE_M, CAMERA)
    assert pose is not None
    # Straight down: the picture's top is ahead.
    assert pose.body_m == pytest.approx((-down, right, ahead), abs=0.03 * ahead)
    assert pose.distance_m == pytest.approx(math.hypot(*place), rel=0.03)
    assert pose.error_px < 1.0


def test_of_several_each_is_found_and_colour_is_as_good() -> None:
    left = seen("aruco-4x4-50", 3, (-0.5, 0.0, 2.0), 10.0, 0.0)
    left[:, 320:] = seen("aruco-4x4-50", 1, (0.5, 0.0, 2.0), 0.0, 0.0)[:, 320:]
    colour = np.asarray(cv2.cvtColor(left, cv2.COLOR_GRAY2BGR), np.uint8)
    detector = MarkerDetector("aruco-4x4-50")
    assert [marker.number for marker in detector.find(colour)] == [1, 3]
    assert [marker.number for marker in detector.find(left)] == [1, 3]


def test_another_family_sees_nothing() -> None:
    assert MarkerDetector("apriltag-36h11").find(seen("aruco-4x4-50", 3, (0.0, 0.0, 2.0), 0.0, 0.0)) == []


def test_an_unknown_family_is_refused() -> None:
    with pytest.raises(ValueError, match="apriltag-36h11"):
        MarkerDetector("qr")


def test_a_side_above_zero_is_needed() -> None:
    with pytest.raises(ValueError, match="side_m"):
        square_pose(((0, 0), (1, 0), (1, 1), (0, 1)), 0.0, CAMERA)


def test_the_pose_of_squares_of_known_side() -> None:
    """The same for concentric squares: their distance from the true side alone."""
    picture = render(2027, 1, with_target=True)
    truth = picture.truth
    assert truth is not None
    (target,) = ConcentricSquareDetector().find(picture.pixels)
    field_of_view_deg = math.degrees(2 * math.atan(320 / 560.0))  # of the rendered camera
    pose = square_pose(target.corners_px, 1.0, CameraModel(640, 480, field_of_view_deg))
    exact = square_pose(_points(truth.corners_px), 1.0, CameraModel(640, 480, field_of_view_deg))
    assert pose is not None
    assert exact is not None
    assert pose.distance_m == pytest.approx(exact.distance_m, rel=0.03)


def _points(corners: npt.NDArray[np.float64]) -> tuple[tuple[float, float], ...]:
    return tuple((float(x), float(y)) for x, y in corners)


def fields_of(pose: SquarePose) -> landing.LandingTarget:
    return landing_target(
        pose.body_m, time_us=1_234_567, kind=landing.VISION_FIDUCIAL, number=7, distance_m=pose.distance_m
    )


def test_the_fields_make_a_message_and_come_back() -> None:
    (marker,) = MarkerDetector("apriltag-36h11").find(seen("apriltag-36h11", 7, *PLACES[1]))
    pose = marker.pose(SIDE_M, CAMERA)
    assert pose is not None
    link = mavlink.MAVLink(None)
    packed = mavlink.MAVLink_landing_target_message(**asdict(fields_of(pose))).pack(link)
    (read,) = mavlink.MAVLink(None).parse_buffer(packed)
    assert read.get_type() == "LANDING_TARGET"
    assert (read.time_usec, read.target_num, read.position_valid) == (1_234_567, 7, 1)
    assert (read.x, read.y, read.z) == pytest.approx(pose.body_m, rel=1e-6)
    assert read.distance == pytest.approx(pose.distance_m)


def test_the_constants_are_those_of_the_dialect() -> None:
    assert landing.FRAME_BODY_FRD == mavlink.MAV_FRAME_BODY_FRD
    assert landing.VISION_FIDUCIAL == mavlink.LANDING_TARGET_TYPE_VISION_FIDUCIAL
    assert landing.VISION_OTHER == mavlink.LANDING_TARGET_TYPE_VISION_OTHER


@pytest.mark.parametrize(
    "mounting", [Mounting(90.0), Mounting(60.0), Mounting(90.0, turn_deg=90.0), Mounting(80.0, spin_deg=30.0)]
)
def test_angles_and_place_say_the_same(mounting: Mounting) -> None:
    """ArduPilot's line of sight from the angles is (-tan angle_y, tan angle_x, 1)."""
    camera = CameraModel(640, 480, 70.0, mounting)
    direction = camera.body_direction(400.0, 300.0)
    fields = landing_target(direction, time_us=0, kind=landing.VISION_OTHER, distance_m=5.0)
    sight = np.array([-math.tan(fields.angle_y), math.tan(fields.angle_x), 1.0])
    place = np.array([fields.x, fields.y, fields.z])
    assert sight / np.linalg.norm(sight) == pytest.approx(place / 5.0)
    assert float(np.linalg.norm(place)) == pytest.approx(5.0)


def test_straight_down_the_angles_are_those_of_the_picture() -> None:
    """Right and down in the picture are positive."""
    fields = landing_target(CAMERA.body_direction(500.0, 400.0), time_us=0, kind=landing.VISION_OTHER)
    right_deg, down_deg = CAMERA.offset_deg(500.0, 400.0)
    assert math.degrees(fields.angle_x) == pytest.approx(right_deg)
    assert math.degrees(fields.angle_y) == pytest.approx(down_deg)
    assert (fields.position_valid, fields.distance, fields.x, fields.y, fields.z) == (0, 0.0, 0.0, 0.0, 0.0)
    assert fields.q == (0.0, 0.0, 0.0, 0.0)


def test_yaw_becomes_a_quaternion_about_down() -> None:
    fields = landing_target((0.0, 0.0, 1.0), time_us=0, kind=landing.VISION_OTHER, yaw_rad=math.pi / 2)
    assert fields.q == pytest.approx((math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))


def test_what_is_not_below_or_out_of_range_is_refused() -> None:
    with pytest.raises(NotBelow):
        landing_target((1.0, 0.0, 0.0), time_us=0, kind=landing.VISION_OTHER)
    with pytest.raises(ValueError, match="distance_m"):
        landing_target((0.0, 0.0, 1.0), time_us=0, kind=landing.VISION_OTHER, distance_m=0.0)
    with pytest.raises(ValueError, match="number"):
        landing_target((0.0, 0.0, 1.0), time_us=0, kind=landing.VISION_OTHER, number=256)
