"""Camera model and places on the ground, against the simulator's own projection and against arithmetic by hand."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from onboard_agent.vision.camera_model import Attitude, CameraModel, Mounting
from onboard_agent.vision.ground_position import GroundPlace, body_place, ground_heading_deg, ground_place, moved_deg
from simulator.camera.view import FIELD_OF_VIEW_DEG, View, pose_of

LEVEL = Attitude(0.0, 0.0, 0.0)
DOWN = CameraModel(640, 480, 75.0)
ATTITUDES = list(itertools.product((-18.0, 0.0, 11.0), (-14.0, 0.0, 9.0), (0.0, 75.0, 210.0)))


@pytest.mark.parametrize(("roll", "pitch", "yaw"), ATTITUDES)
@pytest.mark.parametrize("tilt_deg", [35.0, 60.0, 90.0])
def test_a_place_on_the_ground_is_that_which_the_simulator_projects(
    roll: float, pitch: float, yaw: float, tilt_deg: float
) -> None:
    """The simulator's camera has its own geometry, by quaternion. Every grid point that it shows is found again."""
    view = View(pose_of(40.0, -25.0, 18.0, roll, pitch, yaw), 640, 480, tilt_deg)
    camera = CameraModel(640, 480, FIELD_OF_VIEW_DEG, Mounting(tilt_deg))
    attitude = Attitude(*(math.radians(angle) for angle in (roll, pitch, yaw)))
    seen = 0
    for north, east in itertools.product(range(-20, 101, 8), range(-85, 36, 8)):
        lens = view.to_lens(np.array([north, east, 0.0]))
        if lens[2] <= 0.1:
            continue
        x, y = view.to_pixels(lens)
        if not (0 <= x < 640 and 0 <= y < 480):
            continue
        place = ground_place(camera, (float(x), float(y)), attitude, view.eye_height_m)
        if place is None:
            assert view.eye_height_m < math.sin(math.radians(3.01)) * float(np.linalg.norm(lens))
            continue
        seen += 1
        assert place.north_m + 40.0 == pytest.approx(north, abs=1e-6)
        assert place.east_m - 25.0 == pytest.approx(east, abs=1e-6)
        assert place.distance_m == pytest.approx(float(np.linalg.norm(lens)), rel=1e-9)
    assert seen >= 4


def test_straight_down_the_picture_is_a_map() -> None:
    """75 degrees over 640 pixels: at 10 m the picture's half width is 10 tan 37.5 m."""
    middle = DOWN.middle_px
    place = ground_place(DOWN, middle, LEVEL, 10.0)
    assert place == GroundPlace(pytest.approx(0.0, abs=1e-12), pytest.approx(0.0), pytest.approx(10.0))
    right = ground_place(DOWN, (middle[0] + 320.0, middle[1]), LEVEL, 10.0)
    assert right is not None
    assert right.east_m == pytest.approx(10.0 * math.tan(math.radians(37.5)))
    assert right.bearing_deg == pytest.approx(90.0)
    up = ground_place(DOWN, (middle[0], middle[1] - 100.0), LEVEL, 10.0)
    assert up is not None
    assert up.north_m == pytest.approx(10.0 * 100.0 / DOWN.focal_px)


def test_yaw_turns_the_place_and_pitch_moves_it_ahead() -> None:
    x, y = DOWN.middle_px
    east = ground_place(DOWN, (x, y - 100.0), Attitude(0.0, 0.0, math.pi / 2), 10.0)
    assert east is not None
    assert (east.north_m, east.east_m) == pytest.approx((0.0, 10.0 * 100.0 / DOWN.focal_px))
    nose_up = ground_place(DOWN, (x, y), Attitude(0.0, math.radians(10.0), 0.0), 10.0)
    assert nose_up is not None
    assert nose_up.north_m == pytest.approx(10.0 * math.tan(math.radians(10.0)))
    right_down = ground_place(DOWN, (x, y), Attitude(math.radians(10.0), 0.0, 0.0), 10.0)
    assert right_down is not None
    assert right_down.east_m == pytest.approx(-10.0 * math.tan(math.radians(10.0)))


def test_the_lens_place_in_the_body_counts() -> None:
    camera = CameraModel(640, 480, 75.0, Mounting(90.0, forward_m=0.2, right_m=-0.1, down_m=0.05))
    place = ground_place(camera, camera.middle_px, Attitude(0.0, 0.0, math.pi / 2), 2.05)
    assert place is not None
    assert (place.north_m, place.east_m, place.distance_m) == pytest.approx((0.1, 0.2, 2.0))


def test_no_place_at_the_horizon_above_it_or_under_the_ground() -> None:
    ahead = CameraModel(640, 480, 75.0, Mounting(0.0))
    x, y = ahead.middle_px
    assert ground_place(ahead, (x, y), LEVEL, 10.0) is None
    assert ground_place(ahead, (x, y - 50.0), LEVEL, 10.0) is None
    at_two_degrees = y + ahead.focal_px * math.tan(math.radians(2.0))
    assert ground_place(ahead, (x, at_two_degrees), LEVEL, 10.0) is None
    at_four_degrees = y + ahead.focal_px * math.tan(math.radians(4.0))
    place = ground_place(ahead, (x, at_four_degrees), LEVEL, 10.0)
    assert place is not None
    assert place.north_m == pytest.approx(10.0 / math.tan(math.radians(4.0)))
    assert ground_place(DOWN, DOWN.middle_px, LEVEL, -1.0) is None


@pytest.mark.parametrize(
    ("mounting", "offset", "direction"),
    [
        (Mounting(90.0), (100.0, 0.0), "right"),
        (Mounting(90.0), (0.0, -100.0), "forward"),
        (Mounting(90.0, turn_deg=90.0), (0.0, -100.0), "right"),
        (Mounting(90.0, spin_deg=90.0), (100.0, 0.0), "back"),
        (Mounting(0.0, turn_deg=90.0), (0.0, 0.0), "right"),
        (Mounting(0.0, spin_deg=90.0), (100.0, 0.0), "down"),
    ],
)
def test_offset_from_the_middle_to_direction(mounting: Mounting, offset: tuple[float, float], direction: str) -> None:
    camera = CameraModel(640, 480, 75.0, mounting)
    x, y = camera.middle_px
    seen = np.array(camera.body_direction(x + offset[0], y + offset[1]))
    axis = {"forward": (1, 0, 0), "back": (-1, 0, 0), "right": (0, 1, 0), "down": (0, 0, 1)}[direction]
    straight = np.array(camera.body_direction(x, y))
    moved = seen - straight if any(offset) else seen
    assert float(moved @ np.array(axis)) > 0.99 * float(np.linalg.norm(moved)) - 0.03
    assert float(np.linalg.norm(seen)) == pytest.approx(1.0)


def test_offset_in_degrees() -> None:
    x, y = DOWN.middle_px
    assert DOWN.offset_deg(x + 320.0, y) == pytest.approx((37.5, 0.0))
    assert DOWN.offset_deg(x, y - DOWN.focal_px) == pytest.approx((0.0, -45.0))


def test_projecting_takes_back_the_ray() -> None:
    camera = CameraModel(640, 480, 60.0, Mounting(55.0, turn_deg=20.0, spin_deg=-7.0))
    x, y, z = camera.body_direction(123.0, 321.0)
    assert camera.pixel_of((7 * x, 7 * y, 7 * z)) == pytest.approx((123.0, 321.0))
    assert camera.pixel_of((-x, -y, -z)) is None


def test_the_body_place_has_the_distance() -> None:
    place = ground_place(DOWN, (500.0, 100.0), LEVEL, 12.0)
    assert place is not None
    forward, right, down = body_place(DOWN, place, (500.0, 100.0))
    assert (forward, right, down) == pytest.approx((place.north_m, place.east_m, 12.0))


@pytest.mark.parametrize("heading_deg", [0.0, 30.0, 200.0])
def test_a_heading_in_the_picture_of_a_level_camera_adds_to_yaw(heading_deg: float) -> None:
    attitude = Attitude(0.0, 0.0, math.radians(50.0))
    found = ground_heading_deg(DOWN, DOWN.middle_px, heading_deg, attitude, 10.0)
    assert found == pytest.approx((50.0 + heading_deg) % 360.0)


def test_a_hundred_metres_of_latitude_and_longitude() -> None:
    lat_deg, lon_deg = moved_deg(60.0, 10.0, GroundPlace(100.0, 100.0, 200.0))
    assert (lat_deg - 60.0) * 111_319.49 == pytest.approx(100.0, abs=0.01)
    assert (lon_deg - 10.0) * 111_319.49 / 2 == pytest.approx(100.0, abs=0.01)


@pytest.mark.parametrize("angle", [0.0, 180.0, -5.0])
def test_a_field_of_view_has_limits(angle: float) -> None:
    with pytest.raises(ValueError, match="field of view"):
        CameraModel(640, 480, angle)


def test_a_picture_without_pixels_is_refused() -> None:
    with pytest.raises(ValueError, match="pixels"):
        CameraModel(0, 480, 75.0)
