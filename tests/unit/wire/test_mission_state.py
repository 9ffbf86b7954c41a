"""What earlier items of a mission have set is set again at a start in the middle, or it is named."""

from typing import Any

import pytest

from wire.autopilots import arducopter, px4_multicopter
from wire.autopilots.commands import VehicleState
from wire.autopilots.mission_state import MissionState, state_before
from wire.dialect import mavlink as M
from wire.plans import PlanItem

STATE = VehicleState("hawk", 5, armed=True, airborne=True, home_alt_m=500.0)
ARDUPILOT, PX4 = arducopter.PROFILE.family, px4_multicopter.PROFILE.family
WAY = PlanItem(16, 3, x=471000000, y=82000000, z=30.0)


def do(command: int, *params: float, **place: Any) -> PlanItem:
    return PlanItem(command, params=(*params, 0.0, 0.0, 0.0, 0.0)[:4], **place)  # type: ignore[arg-type]


def state(*items: PlanItem, family: Any = ARDUPILOT, number: int | None = None) -> MissionState:
    return state_before((*items, WAY), len(items) if number is None else number, family, STATE)


def sent(steps: Any) -> list[tuple[int, tuple[float | None, ...]]]:
    return [(step.work.command, step.work.params[:4]) for step in steps]


SPEED, YAW, TRIGGER = M.MAV_CMD_DO_CHANGE_SPEED, M.MAV_CMD_CONDITION_YAW, M.MAV_CMD_DO_SET_CAM_TRIGG_DIST


@pytest.mark.parametrize("family", [ARDUPILOT, PX4])
def test_a_survey_keeps_its_speed_and_its_camera(family: Any) -> None:
    found = state(WAY, do(SPEED, 1, 8, -1), do(TRIGGER, 12, 0, 1), WAY, family=family)
    assert sent(found.before) == [(TRIGGER, (12, 0, 1, 0))]
    assert sent(found.after) == [(SPEED, (1, 8, -1, 0))], "a change of mode forgets it"
    assert found.lacking == ()
    assert found.after[0].phase == "flying at 8 m/s as planned"


def test_the_last_of_each_kind_counts_and_what_follows_does_not() -> None:
    found = state(do(SPEED, 1, 8), WAY, do(SPEED, 0, 5), do(SPEED, 2, 3), WAY, do(SPEED, 1, 9), number=5)
    assert sent(found.after) == [(SPEED, (0, 5, 0, 0)), (SPEED, (2, 3, 0, 0))]


@pytest.mark.parametrize("second", [-1.0, 0.0])
def test_a_speed_that_changes_nothing_changes_nothing(second: float) -> None:
    assert sent(state(do(SPEED, 1, 8), WAY, do(SPEED, 1, second)).after) == [(SPEED, (1, 8, 0, 0))]


def test_back_to_the_autopilots_own_speed() -> None:
    assert state(do(SPEED, 1, 8), WAY, do(SPEED, 1, -2)) == MissionState()


def test_a_camera_that_was_switched_off_is_off() -> None:
    found = state(do(TRIGGER, 12), WAY, do(TRIGGER, 0), WAY)
    assert sent(found.before) == [(TRIGGER, (0, 0, 0, 0))]


def test_photographs_and_video_go_to_whom_the_autopilot_has_them() -> None:
    items = do(M.MAV_CMD_IMAGE_START_CAPTURE, 0, 2, 0), do(M.MAV_CMD_VIDEO_START_CAPTURE), WAY
    assert [step.work.component for step in state(*items).before] == [1, 1]
    assert [step.work.component for step in state(*items, family=PX4).before] == [100, 100]


@pytest.mark.parametrize("command", [M.MAV_CMD_DO_SET_ROI, M.MAV_CMD_DO_SET_ROI_LOCATION])
def test_the_camera_looks_at_the_same_place_and_height(command: int) -> None:
    item = do(command, x=471230000, y=82340000, z=2.0, frame=3)
    (step,) = state(item, WAY).before
    assert (step.work.x, step.work.y, step.work.params[6], step.work.frame) == (471230000, 82340000, 2.0, 3)
    (step,) = state(item, WAY, family=PX4).before
    assert (step.work.x, step.work.params[6], step.work.frame) == (471230000, 502.0, 0), "PX4 reads it above the sea"


def test_a_place_over_the_ground_is_named_not_guessed() -> None:
    item = do(M.MAV_CMD_DO_SET_ROI_LOCATION, x=471230000, y=82340000, z=2.0, frame=10)
    assert state(item, WAY) == MissionState(lacking=("the camera's direction",))


def test_the_newest_direction_of_the_camera_counts_whatever_set_it() -> None:
    place = do(M.MAV_CMD_DO_SET_ROI_LOCATION, x=471230000, y=82340000, z=2.0, frame=3)
    mount = PlanItem(M.MAV_CMD_DO_MOUNT_CONTROL, 2, (-90.0, 0.0, 0.0, 0.0), z=2.0)
    (step,) = state(place, WAY, mount, WAY).before
    assert (step.work.command, step.work.params) == (205, (-90.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0))
    (step,) = state(mount, WAY, do(M.MAV_CMD_DO_SET_ROI_NONE), WAY).before
    assert step.work.command == M.MAV_CMD_DO_SET_ROI_NONE


def test_a_heading_lasts_until_the_next_item_that_flies() -> None:
    assert sent(state(WAY, do(YAW, 90)).after) == [(YAW, (90, 0, 0, 0))]
    assert state(WAY, do(YAW, 90), WAY) == MissionState()
    assert state(WAY, do(YAW, 90, 0, 1, 1)).lacking == ("a heading",), "from which heading is not known"
    assert state(WAY, do(YAW, 90), family=PX4).lacking == ("a heading",)


@pytest.mark.parametrize(
    ("item", "words"),
    [
        (do(M.MAV_CMD_DO_SET_SERVO, 9, 1900), "servo 9 at 1900 \u00b5s"),
        (do(M.MAV_CMD_DO_SET_RELAY, 1, 1), "relay 1 on"),
        (do(M.MAV_CMD_DO_GRIPPER, 1, 0), "gripper 1"),
        (do(M.MAV_CMD_DO_SET_ACTUATOR, 0.5), "the actuators"),
        (do(M.MAV_CMD_DO_SPRAYER, 1), "the sprayer"),
        (do(M.MAV_CMD_DO_FENCE_ENABLE, 1), "the fence"),
        (do(M.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET), "the camera's direction"),
    ],
)
def test_what_could_let_a_load_go_is_named_and_never_done(item: PlanItem, words: str) -> None:
    found = state(item, WAY)
    assert found == MissionState(lacking=(words,))


def test_each_servo_is_named_once_with_its_newest_pulse() -> None:
    servo = M.MAV_CMD_DO_SET_SERVO
    found = state(do(servo, 9, 1100), do(servo, 10, 1500), WAY, do(servo, 9, 1900), WAY)
    assert found.lacking == ("servo 10 at 1500 \u00b5s", "servo 9 at 1900 \u00b5s")


def test_what_does_not_last_is_left_alone() -> None:
    once = [do(number) for number in (112, 114, 177, 203, 189, 600, 601)]
    assert state(WAY, *once, WAY) == MissionState()
