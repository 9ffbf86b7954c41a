"""The settings `payload_release` and `controller_cameras`, and the places of a mission."""

import pytest

from onboard_agent.autonomy.camera_settings import parse_cameras
from onboard_agent.autonomy.core.lines import VIDEO, CameraKind, Waypoint
from onboard_agent.autonomy.core.mission import waypoints
from onboard_agent.autonomy.core.payload_release import parse_release
from onboard_agent.unusable import Unusable
from wire.dialect import mavlink
from wire.plans import PlanItem


def test_a_gripper_and_a_servo() -> None:
    gripper = parse_release("gripper:2")
    assert (gripper.command, gripper.params[:2]) == (mavlink.MAV_CMD_DO_GRIPPER, (2.0, 0.0))
    servo = parse_release("servo:9=1900")
    assert (servo.command, servo.params[:2]) == (mavlink.MAV_CMD_DO_SET_SERVO, (9.0, 1900.0))


@pytest.mark.parametrize("text", ["", "gripper", "gripper:0", "servo:9", "servo:9=100", "servo:9=2501", "servo:0=1500"])
def test_no_release(text: str) -> None:
    with pytest.raises(Unusable, match="payload_release"):
        parse_release(text)


def test_cameras_of_all_kinds() -> None:
    down, warm, own = parse_cameras(
        ["down,tilt=80,fov=60.5,up=-0.1 http://127.0.0.1:1/a?b=c,d", "warm,kind=infrared v4l2:/dev/video2", "own video"]
    )
    assert (down.name, down.source) == ("down", "http://127.0.0.1:1/a?b=c,d")
    assert (down.tilt_deg, down.field_of_view_deg, down.up_m) == (80.0, 60.5, -0.1)
    assert (warm.kind, warm.source) == (CameraKind.INFRARED, "v4l2:/dev/video2")
    assert (own.source, own.kind, own.tilt_deg) == (VIDEO, CameraKind.COLOUR, 90.0)


@pytest.mark.parametrize(
    "texts",
    [
        ["down"],
        ["Down video"],
        ["down,tilt=91 video"],
        ["down,fov=x video"],
        ["down,kind=warm video"],
        ["down,zoom=2 video"],
        ["down ftp://x/"],
        ["a video", "a video"],
    ],
)
def test_no_cameras(texts: list[str]) -> None:
    with pytest.raises(Unusable):
        parse_cameras(texts)


def test_the_places_of_a_mission() -> None:
    items = (
        PlanItem(22, 3, x=1, y=1, z=10.0),
        PlanItem(16, 3, x=474000000, y=85000000, z=12.0),
        PlanItem(16, 0, x=475000000, y=85000000, z=500.0),
        PlanItem(16, 3, x=0, y=0, z=12.0),
        PlanItem(183, 2, (9.0, 1900.0, 0.0, 0.0)),
        PlanItem(20, 2),
    )
    assert waypoints(items) == (Waypoint(47.4, 8.5, 12.0), Waypoint(47.5, 8.5, None))
    assert len(waypoints(items * 100)) == 80
