"""All parts together: a vehicle descends over a target that lies turned on the ground, with a swaying attitude, and
finds its place, heading and letter. The simulator's own projection draws the pictures."""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt

from onboard_agent.vision.camera_model import Attitude, CameraModel, Mounting
from onboard_agent.vision.ground_position import ground_heading_deg, ground_place
from onboard_agent.vision.target_finder import finder_of
from onboard_agent.vision.target_kind import parse_kind
from onboard_agent.vision.target_tracker import TrackState
from simulator.camera.view import FIELD_OF_VIEW_DEG, View, pose_of
from simulator.target_pictures.textures import TEXTURE_PX, target

SIDE_M = 1.5
NORTH_M, EAST_M = 3.0, -2.0
HEADING_DEG = 130.0
TILT_DEG = 80.0
CAMERA = CameraModel(640, 480, FIELD_OF_VIEW_DEG, Mounting(TILT_DEG))


def picture_of(view: View, rng: np.random.Generator) -> npt.NDArray[np.uint8]:
    """Draws the target through the images of its four corners, blurs, adds noise."""
    angle = math.radians(HEADING_DEG)
    ahead, right = np.array([math.cos(angle), math.sin(angle), 0.0]), np.array([-math.sin(angle), math.cos(angle), 0.0])
    middle = np.array([NORTH_M, EAST_M, 0.0])
    corners = np.array([middle + SIDE_M / 2 * (a * ahead + b * right) for a, b in ((1, -1), (1, 1), (-1, 1), (-1, -1))])
    edge = TEXTURE_PX - 0.5
    sheet = np.array([(-0.5, -0.5), (edge, -0.5), (edge, edge), (-0.5, edge)], np.float32)
    to_picture = cv2.getPerspectiveTransform(sheet, view.to_pixels(view.to_lens(corners)).astype(np.float32))
    texture = target("K", 4, np.random.default_rng(3))
    picture = np.full((480, 640), 130, np.uint8)
    drawn = cv2.warpPerspective(texture.pixels, to_picture, (640, 480), flags=cv2.INTER_LINEAR)
    cv2.copyTo(drawn, cv2.warpPerspective(texture.mask, to_picture, (640, 480)), picture)
    seen = cv2.GaussianBlur(picture, (0, 0), 0.9).astype(np.float64) + rng.normal(0.0, 4.0, picture.shape)
    return np.clip(seen, 0, 255).astype(np.uint8)


def test_a_descent_over_a_target() -> None:
    rng = np.random.default_rng(11)
    finder = finder_of(parse_kind("squares"))
    place_errors_m, heading_errors_deg, letters, states = [], [], [], []
    for number in range(30):
        now_s = number * 0.1
        height_m = 12.0 - 0.25 * number
        north_m, east_m = 0.12 * number, -0.06 * number
        roll, pitch, yaw = 6.0 * math.sin(number / 3), 5.0 * math.cos(number / 4), 20.0 + 1.5 * number
        view = View(pose_of(north_m, east_m, height_m, roll, pitch, yaw), 640, 480, TILT_DEG)
        sighting = finder.look(picture_of(view, rng), now_s)
        track = sighting.track
        assert track is not None
        states.append(track.state)
        letters.append(sighting.letter.letter if sighting.letter else "")
        attitude = Attitude(math.radians(roll), math.radians(pitch), math.radians(yaw))
        place = ground_place(CAMERA, track.latest.centre_px, attitude, view.eye_height_m)
        assert place is not None
        place_errors_m.append(math.hypot(north_m + place.north_m - NORTH_M, east_m + place.east_m - EAST_M))
        if sighting.heading_deg is not None:
            pixel = track.latest.centre_px
            found = ground_heading_deg(CAMERA, pixel, sighting.heading_deg, attitude, view.eye_height_m)
            assert found is not None
            heading_errors_deg.append(abs((found - HEADING_DEG + 180.0) % 360.0 - 180.0))
    assert states == [TrackState.TENTATIVE] * 2 + [TrackState.CONFIRMED] * 28
    assert letters[:3] == ["", "", ""]
    assert set(letters[6:]) == {"K"}
    assert max(place_errors_m) < 0.03
    assert len(heading_errors_deg) >= 24
    assert float(np.median(heading_errors_deg)) < 0.5
    assert max(heading_errors_deg) < 3.0
