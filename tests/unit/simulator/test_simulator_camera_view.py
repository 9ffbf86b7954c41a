"""Geometry of the camera's pictures: the horizon, the pads, and their motion as the vehicle moves."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from simulator.camera.ground_map import ground_map
from simulator.camera.land import SIZE_M, bend, bent, make_land
from simulator.camera.marks import Mark
from simulator.camera.overlay import clock_text
from simulator.camera.request import BadRequest, Wanted, read_unplugged_s, read_wanted
from simulator.camera.scene import Scene
from simulator.camera.server import CameraEndpoint, parse_camera
from simulator.camera.shared_poses import make_shared_poses
from simulator.camera.view import EYE_HEIGHT_M, Pose, View, cut, pose_of

LEVEL = pose_of(0.0, 0.0, 20.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene(1, [Mark(0.0, 0.0, "1"), Mark(20.0, 0.0, "2")])


def draw(scene: Scene, pose: Pose, tilt_deg: float, width: int = 320, height: int = 240) -> np.ndarray:
    return scene.draw(pose, width, height, tilt_deg=tilt_deg, now_s=0.0).astype(int)


def dip_at(view: View, x: float, y: float) -> float:
    return float(view.dip @ (x, y, 1.0))


def where_orange(picture: np.ndarray) -> np.ndarray:
    """Returns rows and columns of the pads' rings."""
    blue, green, red = picture[..., 0], picture[..., 1], picture[..., 2]
    return np.argwhere((red > 180) & (blue < 110) & (green > 70) & (green < 160))


def test_the_horizon_of_a_level_camera_is_in_the_middle_and_rises_as_it_looks_down() -> None:
    assert dip_at(View(LEVEL, 640, 480, 0.0), 100.0, 239.5) == pytest.approx(0.0)
    for tilt_deg in (10.0, 30.0):
        view = View(LEVEL, 640, 480, tilt_deg)
        y = 239.5 - view.focal_px * math.tan(math.radians(tilt_deg))
        assert dip_at(view, 333.0, y) == pytest.approx(0.0, abs=1e-9)


def test_rolled_to_the_right_the_horizon_falls_to_the_left() -> None:
    """As for a pilot: the right wing is down, so the ground comes up on the right."""
    view = View(pose_of(0, 0, 20, 20.0, 0, 0), 640, 480, 0.0)
    assert dip_at(view, 639.0, 239.5) > 0.0 > dip_at(view, 0.0, 239.5)


def test_nose_up_the_horizon_sinks() -> None:
    assert dip_at(View(pose_of(0, 0, 20, 0, 10.0, 0), 640, 480, 0.0), 320.0, 239.5) < 0.0


@pytest.mark.parametrize(("yaw", "place"), [(0, (50, 0)), (90, (0, 50)), (180, (-50, 0)), (270, (0, -50))])
def test_what_lies_ahead_is_in_the_middle(yaw: float, place: tuple[float, float]) -> None:
    view = View(pose_of(0, 0, 20, 0, 0, yaw), 640, 480, 0.0)
    x, y = view.to_pixels(view.to_lens(np.array([[*place, -20.0 - EYE_HEIGHT_M]])))[0]
    assert (x, y) == pytest.approx((319.5, 239.5))


def test_what_lies_east_of_north_is_to_the_right() -> None:
    view = View(LEVEL, 640, 480, 20.0)
    x, _ = view.to_pixels(view.to_lens(np.array([[50.0, 10.0, 0.0]])))[0]
    assert x == pytest.approx(319.5 + 77.4, abs=0.1)


def test_ground_and_points_agree() -> None:
    """A point on the ground lands on the pixel whose ray meets the ground there."""
    view = View(pose_of(12, -7, 33, 11, -9, 140), 640, 480, 35.0)
    to_map = view.plane_to_texture(0.0, 0.5, 100.0)
    for x, y in ((10.0, 400.0), (320.0, 300.0), (600.0, 470.0)):
        u, v, w = to_map @ (x, y, 1.0)
        north, east = (100.0 - v / w) * 0.5, (u / w - 100.0) * 0.5
        assert view.to_pixels(view.to_lens(np.array([[north, east, 0.0]])))[0] == pytest.approx((x, y))


@pytest.mark.parametrize("roll", [-70.0, -12.0, 0.0, 30.0, 100.0, 180.0])
def test_boxes_hold_every_pixel_and_do_not_overlap(roll: float) -> None:
    view = View(pose_of(0, 0, 20, roll, -5, 30), 160, 120, 20.0)
    xs, ys = np.meshgrid(np.arange(160), np.arange(120))
    dip = view.dip[0] * xs + view.dip[1] * ys + view.dip[2]
    for low, high in ((-math.inf, 0.05), (0.1, 0.2), (0.2, math.inf)):
        covered = np.zeros((120, 160), int)
        for left, top, right, bottom in view.boxes_where(low, high):
            covered[top:bottom, left:right] += 1
        assert covered.max() <= 1
        assert (covered[(dip >= low) & (dip <= high)] == 1).all()


def test_a_polygon_is_cut() -> None:
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    assert cut(square, (1.0, 0.0), -1.0) is square
    assert len(cut(square, (1.0, 0.0), 3.0)) == 0
    assert sorted(map(tuple, cut(square, (1.0, 0.0), 1.0).tolist())) == [(1, 0), (1, 2), (2, 0), (2, 2)]


def test_from_above_ones_own_pad_is_in_the_middle_and_as_large_as_it_must_be(scene: Scene) -> None:
    height_m = 10.0
    found = where_orange(draw(scene, pose_of(0, 0, height_m, 0, 0, 0), 90.0))
    assert found.mean(axis=0) == pytest.approx((119.5, 159.5), abs=2.5)
    focal_px = 160 / math.tan(math.radians(37.5))
    ring_m = 5.0 * (2 * (236 + 11)) / 512
    assert np.ptp(found[:, 1]) == pytest.approx(ring_m / (height_m + EYE_HEIGHT_M) * focal_px, rel=0.06)


def test_the_pad_moves_against_the_vehicle(scene: Scene) -> None:
    """Straight down, north up: flying north the pad sinks, flying east it goes to the left."""
    still, north, east = (
        where_orange(draw(scene, pose_of(n, e, 12, 0, 0, 0), 90.0)).mean(axis=0) for n, e in ((0, 0), (-2, 0), (0, 2))
    )
    assert north[0] < still[0] - 15
    assert east[1] < still[1] - 15


def test_the_sky_is_above_the_horizon_and_the_land_below(scene: Scene) -> None:
    picture = draw(scene, LEVEL, 0.0)
    top, bottom = picture[20:60].mean(axis=(0, 1)), picture[180:220].mean(axis=(0, 1))
    assert top[0] > top[2] + 10, "no blue sky"
    assert bottom[1] > bottom[0] + 15, "no green land"
    upside_down = draw(scene, pose_of(0, 0, 20, 180, 0, 0), 0.0)
    assert upside_down[180:220].mean(axis=(0, 1))[0] > upside_down[20:60].mean(axis=(0, 1))[0]


def test_the_same_seed_and_pose_are_the_same_picture_and_others_are_not(scene: Scene) -> None:
    first = draw(scene, LEVEL, 20.0)
    assert (draw(scene, LEVEL, 20.0) == first).all()
    assert (draw(scene, pose_of(0, 0, 20, 0, 0, 1.0), 20.0) != first).mean() > 0.3


@pytest.mark.parametrize("field_of_view_deg", [60.0, 75.0, 100.0])
def test_the_field_of_view_reaches_from_the_left_edge_to_the_right(field_of_view_deg: float) -> None:
    view = View(pose_of(0.0, 0.0, 10.0, 0.0, 0.0, 0.0), 641, 480, 90.0, field_of_view_deg)
    half_m = view.eye_height_m * math.tan(math.radians(field_of_view_deg / 2))
    edge = view.to_pixels(view.to_lens(np.array([0.0, half_m, 0.0])))
    assert edge[0] == pytest.approx(640.5, abs=0.01)


@pytest.mark.parametrize(
    ("height_m", "roll", "pitch", "tilt_deg"),
    [(h, r, p, t) for h, (r, p) in itertools.product((0, 300), ((0, 0), (75, 40), (180, 0))) for t in (0, 20, 90)],
)
def test_every_attitude_can_be_drawn(scene: Scene, height_m: float, roll: float, pitch: float, tilt_deg: float) -> None:
    picture = draw(scene, pose_of(55, 30, height_m, roll, pitch, 77), tilt_deg, 160, 120)
    assert picture.std() > 3.0


def test_the_map_repeats_without_a_seam() -> None:
    finest = ground_map(1).levels[2].astype(int)
    seam = np.abs(finest[:, 0] - finest[:, -1]).mean()
    beside = np.mean([np.abs(finest[:, x] - finest[:, x + 1]).mean() for x in range(100, 900, 40)])
    assert seam < 3.0 * beside


def test_where_drones_stand_the_land_is_not_bent_and_nothing_is_in_the_way() -> None:
    for seed in range(2):
        land = make_land(seed)
        assert min(math.hypot(house.north_m, house.east_m) for house in land.houses) > 35.0
        assert min(math.hypot(tree.north_m, tree.east_m) for tree in land.trees) > 30.0
    for moved in bent(np.array([0.0, 0.0, 15.0]), np.array([0.0, 15.0, 0.0])):
        assert moved.min() > -0.6
        assert moved.max() < 15.6
    edge = np.array([SIZE_M / 2])
    for one, other in zip(bend(edge, edge / 3), bend(-edge, edge / 3), strict=True):
        assert one == pytest.approx(other)


def test_what_viewers_ask_for() -> None:
    assert read_wanted("/camera", "vehicle 1") == Wanted(640, 480, 30, 20, 75, 85, "vehicle 1")
    asked = "/camera?width=320&height=240&rate=24&name=Kestrel&tilt=90&quality=60&fov=100"
    assert read_wanted(asked, "x") == Wanted(320, 240, 24, 90, 100, 60, "Kestrel")
    assert read_unplugged_s("/unplug") == 5.0
    assert read_unplugged_s("/unplug?seconds=12") == 12.0


@pytest.mark.parametrize(
    "query",
    ["width=63", "width=99999", "height=x", "rate=0", "rate=-3", "tilt=91", "fov=9", "colour=1", "name=ü", "width=²"],
)
def test_what_viewers_may_not_ask_for(query: str) -> None:
    with pytest.raises(BadRequest, match=query.partition("=")[0]):
        read_wanted(f"/camera?{query}", "x")


def test_endpoints() -> None:
    assert parse_camera("8090") == CameraEndpoint("127.0.0.1", 8090)
    assert parse_camera("0.0.0.0:8090") == CameraEndpoint("0.0.0.0", 8090)
    assert str(parse_camera("[::1]:8090")) == "http://[::1]:8090/camera"
    for text in ("", ":80", "host:", "x", "0", "65536", "host:1x"):
        with pytest.raises(ValueError, match="is not"):
            parse_camera(text)


def test_the_clock_for_people() -> None:
    assert clock_text(1_772_366_400_123_999, with_date=True) == "2026-03-01 12:00:00.123 UTC"
    assert clock_text(1_772_366_400_007_000, with_date=False) == "12:00:00.007 UTC"


def test_sights_are_read_as_they_were_written() -> None:
    file, poses = make_shared_poses(2)
    pose = pose_of(1, 2, 3, 4, 5, 6)
    poses.write(1, pose, 7.5)
    assert poses.read(1) == (pose, 7.5)
    assert poses.read(0) == (Pose(0.0, 0.0, 0.0), 0.0)
    poses.close()
    file.close()
