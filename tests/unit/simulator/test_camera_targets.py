"""Landing targets on the simulator's land: target finding finds them where they are, and reads their letters."""

import math

import pytest

from onboard_agent.vision.camera_model import Attitude, CameraModel, Mounting
from onboard_agent.vision.character_reader import CharacterReader
from onboard_agent.vision.concentric_squares import ConcentricSquareDetector
from onboard_agent.vision.ground_position import ground_heading_deg, ground_place
from onboard_agent.vision.target_finder import detector_of
from onboard_agent.vision.target_kind import parse_kind
from simulator.camera.scene import Scene
from simulator.camera.targets import GroundTarget, parse_target
from simulator.camera.view import EYE_HEIGHT_M, pose_of

CAMERA = CameraModel(640, 480, 75.0, Mounting(tilt_deg=90.0, down_m=-EYE_HEIGHT_M))


@pytest.mark.parametrize(
    ("letter", "north_m", "east_m", "heading_deg", "angles"),
    [
        ("K", 3.0, 1.0, 30.0, (2.0, -3.0, 20.0)),
        ("R", -1.0, -2.0, 250.0, (0.0, 0.0, 0.0)),
        ("A", 0.0, 3.0, 135.0, (8.0, 5.0, 300.0)),
    ],
)
@pytest.mark.parametrize("light", [0.4, 1.0])
def test_a_target_is_found_where_it_is(
    letter: str, north_m: float, east_m: float, heading_deg: float, angles: tuple[float, float, float], light: float
) -> None:
    scene = Scene(3, [], targets=[GroundTarget(letter, north_m, east_m, heading_deg, 1.2, 1)], light=light)
    picture = scene.draw(pose_of(0.0, 0.0, 8.0, *angles), 640, 480, tilt_deg=90, now_s=0.0)
    (target,) = ConcentricSquareDetector().find(picture)
    attitude = Attitude(*(math.radians(angle) for angle in angles))
    place = ground_place(CAMERA, target.centre_px, attitude, 8.0)
    assert place is not None
    # The simulator keeps the lens above the vehicle however that leans.
    assert (place.north_m, place.east_m) == pytest.approx((north_m, east_m), abs=0.05)
    reading = CharacterReader().read(picture, target)
    assert reading is not None
    assert reading.letter == letter
    top = target.headings_deg[reading.quarter_turns]
    heading = ground_heading_deg(CAMERA, target.centre_px, top, attitude, 8.0)
    assert heading is not None
    assert abs((heading - heading_deg + 180.0) % 360.0 - 180.0) < 3.0


@pytest.mark.parametrize(("text", "colour"), [("K", "red"), ("7A", "blue"), ("R", "yellow"), ("42", "black")])
@pytest.mark.parametrize("up_m", [4.0, 8.0])
def test_the_sources_target_is_found_where_it_is(text: str, colour: str, up_m: float) -> None:
    scene = Scene(3, [], targets=[GroundTarget(text, 0.5, -0.4, 70.0, 2.0, 1, colour)])
    picture = scene.draw(pose_of(0.0, 0.0, up_m, 2.0, -3.0, 20.0), 640, 480, tilt_deg=90, now_s=0.0)
    (target,) = detector_of(parse_kind("white 2, any 1")).find(picture)
    attitude = Attitude(*(math.radians(angle) for angle in (2.0, -3.0, 20.0)))
    place = ground_place(CAMERA, target.centre_px, attitude, up_m)
    assert place is not None
    assert (place.north_m, place.east_m) == pytest.approx((0.5, -0.4), abs=0.05)
    reading = CharacterReader().read(picture, target)
    assert reading is None or reading.letter == text
    assert reading is not None or up_m > 4.0


def test_the_option() -> None:
    assert parse_target("K@47.5,8.5") == ("K", 47.5, 8.5, 0.0, 1.2, "")
    assert parse_target("K@47.5,-8.5,90") == ("K", 47.5, -8.5, 90.0, 1.2, "")
    assert parse_target("K@47.5,8.5,90,2.5") == ("K", 47.5, 8.5, 90.0, 2.5, "")
    assert parse_target("A7:blue@47.5,8.5,90") == ("A7", 47.5, 8.5, 90.0, 2.0, "blue")


@pytest.mark.parametrize(
    "text",
    [
        "K",
        "k@1,2",
        "KL@1,2",
        "K@1",
        "K@91,2",
        "K@1,2,3,0",
        "K@1,2,3,4,5",
        "@1,2",
        "K@x,y",
        "A:pink@1,2",
        "ABCD:red@1,2",
        ":red@1,2",
    ],
)
def test_no_target(text: str) -> None:
    with pytest.raises(ValueError, match=r"LETTER@LAT,LON|no such place"):
        parse_target(text)
