"""Commands that pass as frames: reported once, with their acknowledgement, and at a limited rate."""

from dataclasses import dataclass, field
from typing import Any

import pytest

from server.kernel.clock import utc_now
from server.kernel.people import UserRef
from server.operations.core.observed_commands import (
    ANSWER_WITHIN_S,
    MAX_OPEN,
    MAX_STREAM_S,
    SAME_WITHIN_S,
    SHOWN,
    CommandObserved,
    ObservedCommands,
)
from server.operations.core.observed_table import NOT_COMMANDS, command_of
from wire.dialect import build, mavlink
from wire.ids import DroneId, UserId

M = mavlink
ALICE, BOB = UserRef(UserId(1), "alice"), UserRef(UserId(2), "bob")
KESTREL = DroneId(7)
NAN = float("nan")


def long(command: int, *params: float, confirmation: int = 0) -> Any:
    return M.MAVLink_command_long_message(1, 1, command, confirmation, *[*params, *[0.0] * 7][:7])


def ack(command: int, result: int = 0, system: int = 255) -> Any:
    return M.MAVLink_command_ack_message(command, result, target_system=system, target_component=190)


@dataclass
class Scene:
    reported: list[CommandObserved] = field(default_factory=list)
    now: float = 100.0
    mode: int | None = None

    def __post_init__(self) -> None:
        self.core = ObservedCommands(utc_now)
        self.core.on_settled = self.reported.append

    def sent(self, message: Any, by: UserRef = ALICE) -> None:
        frame = build(message, system_id=255, component_id=190, sequence=0)
        self.core.sent(KESTREL, by, "198.51.100.7", frame, self.now)

    def heard(self, message: Any) -> None:
        self.core.heard(KESTREL, build(message, system_id=1, component_id=1, sequence=0), self.now)

    def passes(self, seconds: float) -> list[tuple[str, str, int]]:
        self.now += seconds
        self.core.tick(self.now, lambda _: self.mode)
        reported, self.reported[:] = [(one.command, one.result, one.count) for one in self.reported], []
        return reported


@pytest.fixture
def scene() -> Scene:
    return Scene()


@pytest.mark.parametrize(
    ("message", "name"),
    [
        (long(M.MAV_CMD_COMPONENT_ARM_DISARM, 1), "arm"),
        (long(M.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196), "disarm"),
        (long(M.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, NAN, 0, 0, 10), "takeoff"),
        (M.MAVLink_command_int_message(1, 1, 3, M.MAV_CMD_DO_REPOSITION, 0, 0, -1, 1, 0, NAN, 1, 2, 30), "goto"),
        (long(M.MAV_CMD_DO_PAUSE_CONTINUE, 0), "pause"),
        (long(M.MAV_CMD_DO_PAUSE_CONTINUE, 1), "resume"),
        (long(M.MAV_CMD_DO_FLIGHTTERMINATION, 1), "MAV_CMD_DO_FLIGHTTERMINATION"),
        (M.MAVLink_set_mode_message(1, 1, 4), "mode"),
        (M.MAVLink_mission_count_message(1, 1, 12, 1), "plan_upload"),
        (M.MAVLink_mission_clear_all_message(1, 1, 0), "plan_clear"),
        (M.MAVLink_mission_set_current_message(1, 1, 3), "jump"),
        (M.MAVLink_param_set_message(1, 1, b"RTL_ALT", 1500, 9), "parameters_write"),
        (M.MAVLink_log_erase_message(1, 1), "LOG_ERASE"),
    ],
)
def test_what_flies_a_drone_is_told_by_its_name(scene: Scene, message: Any, name: str) -> None:
    scene.sent(message)
    assert [reported[0] for reported in scene.passes(61)] == [name]


@pytest.mark.parametrize(
    "message",
    [
        *(long(number) for number in sorted(NOT_COMMANDS)),
        M.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0),
        M.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3),
        M.MAVLink_mission_item_int_message(1, 1, 0, 3, 16, 0, 1, 0, 0, 0, 0, 0, 0, 0),
    ],
)
def test_telemetry_sticks_and_parts_of_a_plan_are_no_commands(message: Any) -> None:
    assert command_of(build(message, system_id=255, component_id=190, sequence=0)) is None


def test_a_command_is_told_with_who_where_and_the_answer(scene: Scene) -> None:
    scene.sent(long(M.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196))
    scene.heard(ack(M.MAV_CMD_COMPONENT_ARM_DISARM, M.MAV_RESULT_DENIED))
    scene.now += SAME_WITHIN_S + 0.1
    scene.core.tick(scene.now, lambda _: None)
    (reported,) = scene.reported
    assert (reported.drone_id, reported.by, reported.address, reported.result) == (
        KESTREL,
        ALICE,
        "198.51.100.7",
        "denied",
    )
    assert reported.detail == {
        "message": "MAV_CMD_COMPONENT_ARM_DISARM",
        "params": [0.0, 21196.0],
        "sender": "255/190",
    }
    assert not scene.core.waits(KESTREL)


def test_without_an_answer_it_is_told_after_its_time(scene: Scene) -> None:
    scene.sent(long(M.MAV_CMD_NAV_LAND))
    assert scene.passes(ANSWER_WITHIN_S) == []
    assert scene.passes(0.1) == [("land", "no answer", 1)]


def test_the_answer_to_somebody_else_is_none(scene: Scene) -> None:
    scene.sent(long(M.MAV_CMD_NAV_LAND))
    scene.heard(ack(M.MAV_CMD_NAV_LAND, system=1))
    scene.heard(ack(M.MAV_CMD_NAV_TAKEOFF))
    assert scene.passes(ANSWER_WITHIN_S + 0.1) == [("land", "no answer", 1)]


def test_in_progress_is_not_the_end(scene: Scene) -> None:
    scene.sent(long(M.MAV_CMD_NAV_TAKEOFF))
    scene.heard(ack(M.MAV_CMD_NAV_TAKEOFF, M.MAV_RESULT_IN_PROGRESS))
    assert scene.passes(20) == []
    scene.heard(ack(M.MAV_CMD_NAV_TAKEOFF, system=0))
    assert scene.passes(1) == [("takeoff", "accepted", 1)]


def test_each_in_progress_is_waited_for_and_not_for_ever(scene: Scene) -> None:
    scene.sent(long(M.MAV_CMD_NAV_TAKEOFF))
    for _ in range(10):
        scene.heard(ack(M.MAV_CMD_NAV_TAKEOFF, M.MAV_RESULT_IN_PROGRESS))
        assert scene.passes(25) == []
    for _ in range(10):
        scene.heard(ack(M.MAV_CMD_NAV_TAKEOFF, M.MAV_RESULT_IN_PROGRESS))
        if scene.passes(25) == [("takeoff", "in progress", 1)]:
            return
    raise AssertionError("it never ended")


@pytest.mark.parametrize(("params", "mode"), [((1, 4, 0), 4), ((1, 4, 3), 4 << 16 | 3 << 24)])
def test_a_mode_that_the_heartbeat_shows_is_an_answer(scene: Scene, params: tuple[int, ...], mode: int) -> None:
    scene.sent(long(M.MAV_CMD_DO_SET_MODE, *params))
    scene.mode = mode
    assert scene.passes(ANSWER_WITHIN_S + 0.1) == [("mode", SHOWN, 1)]


def test_sent_again_within_a_second_or_as_a_repeat_it_is_one_counted(scene: Scene) -> None:
    for _ in range(10):
        scene.sent(long(M.MAV_CMD_NAV_LAND))
        assert scene.passes(0.5) == []
    scene.now += 2
    scene.sent(long(M.MAV_CMD_NAV_LAND, confirmation=1))
    scene.heard(ack(M.MAV_CMD_NAV_LAND))
    assert scene.passes(1.1) == [("land", "accepted", 11)]


def test_asked_anew_it_is_another(scene: Scene) -> None:
    scene.sent(long(M.MAV_CMD_NAV_LAND))
    scene.now += 2
    scene.sent(long(M.MAV_CMD_NAV_LAND))
    scene.heard(ack(M.MAV_CMD_NAV_LAND))
    assert scene.passes(1.1) == [("land", "no answer", 1), ("land", "accepted", 1)]


def test_arming_is_not_disarming_and_one_pilot_not_the_other(scene: Scene) -> None:
    scene.sent(long(M.MAV_CMD_COMPONENT_ARM_DISARM, 1))
    scene.sent(long(M.MAV_CMD_COMPONENT_ARM_DISARM, 0))
    scene.sent(long(M.MAV_CMD_COMPONENT_ARM_DISARM, 0), BOB)
    assert [reported[0] for reported in scene.passes(6)] == ["arm", "disarm", "disarm"]


def test_set_mode_is_answered_by_the_heartbeat(scene: Scene) -> None:
    scene.sent(M.MAVLink_set_mode_message(1, 1, 4))
    scene.mode = 4
    assert scene.passes(6) == [("mode", "its heartbeat shows it", 1)]
    scene.sent(M.MAVLink_set_mode_message(1, 1, 5))
    assert scene.passes(6) == [("mode", "no answer", 1)]


def test_plans_and_parameters_have_answers_of_their_own(scene: Scene) -> None:
    scene.sent(M.MAVLink_mission_count_message(1, 1, 12, 1))
    scene.sent(M.MAVLink_param_set_message(1, 1, b"RTL_ALT", 1500, 9))
    scene.heard(M.MAVLink_mission_ack_message(255, 190, 13, 1))
    scene.heard(M.MAVLink_mission_ack_message(255, 190, 0, 0))
    scene.heard(M.MAVLink_param_value_message(b"RTL_ALT", 1500, 9, 100, 3))
    assert scene.passes(1.1) == [("plan_upload", "invalid sequence", 1), ("parameters_write", "it is 1500", 1)]


def test_a_stream_is_told_once_in_a_while(scene: Scene) -> None:
    stream = M.MAVLink_set_position_target_global_int_message(0, 1, 1, 6, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    reported = []
    for _ in range(int(MAX_STREAM_S * 20) + 40):
        scene.sent(stream)
        reported += scene.passes(0.05)
    reported += scene.passes(2)
    assert [one[:2] for one in reported] == [("SET_POSITION_TARGET_GLOBAL_INT", "sent")] * 2
    assert sum(count for _, _, count in reported) == int(MAX_STREAM_S * 20) + 40


def test_a_flood_of_different_commands_is_bounded(scene: Scene) -> None:
    for number in range(10_000, 10_000 + 5 * MAX_OPEN):
        scene.sent(long(number))
    reported = scene.passes(6)
    assert len(reported) == MAX_OPEN + 1
    assert sum(count for _, _, count in reported) == 5 * MAX_OPEN
    assert reported[-1][0] == "more commands"


def test_what_is_open_when_the_tower_ends_is_told(scene: Scene) -> None:
    scene.sent(long(M.MAV_CMD_NAV_LAND))
    scene.core.settle_all()
    assert [one.result for one in scene.reported] == ["no answer"]
