"""Landing at a place: the go-to, the wait for the arrival, and everything that keeps the landing from being sent."""

from dataclasses import replace
from typing import Any

import pytest
from hub_world import record
from operation_scene import ALICE, COMMAND
from test_follow_feed import FollowScene, beat

from server.airspace.core.separation.motion import METRES_PER_DEGREE
from server.operations.core.flying.bodies import LandAt
from server.operations.core.flying.land_at import (
    EXTRA_S,
    FRESH_S,
    LINK_PATIENCE_S,
    MODE_WITHIN_S,
    STANDS_FOR_S,
    NotInTheAir,
    land_at_order,
)
from server.operations.core.operation import Operation, State
from wire.dialect import build, mavlink
from wire.transactions import CommandWork, Outcome, Transaction

PLACE = (47.002, 8.0)
WAY_M = 0.001 * METRES_PER_DEGREE
HEIGHT_M = 20.0
GUIDED, RTL, LAND, BRAKE = 4, 6, 9, 17


class LandScene(FollowScene):
    """Drone 1, held by alice, in the air in GUIDED, 111 m south of the place. It reports each 0.5 s."""

    def __init__(self) -> None:
        super().__init__()
        self.lat, self.height_m, self.speed_m_s, self.mode = 47.001, HEIGHT_M, 0.0, GUIDED
        self.speaks = True
        self.ordered = land_at_order(self.drone, self.body(), self.now)

    @staticmethod
    def body(**more: Any) -> LandAt:
        return LandAt(command="land_at", lat=PLACE[0], lon=PLACE[1], height_m=HEIGHT_M, **more)

    def land_at(self) -> Operation:
        return self.service.begin(self.drone, self.ordered, by=ALICE, now=self.now)

    def on_the_way(self) -> Operation:
        """The go-to was accepted."""
        operation = self.land_at()
        (sent,) = self.sent()
        assert isinstance(sent.work, CommandWork)
        assert sent.work.command == mavlink.MAV_CMD_DO_REPOSITION
        self.end(operation)
        return operation

    def fly(self, seconds: float) -> None:
        """Time in which the drone reports where it is."""
        for _ in range(round(seconds / 0.5)):
            self.now += 0.5
            if self.speaks:
                self.agent_.send(beat(self.mode), self.placed(), now=self.now)
            self.service.tick(self.now)

    def placed(self) -> bytes:
        message = mavlink.MAVLink_global_position_int_message(
            5,
            round(self.lat * 1e7),
            80000000,
            500_000,
            round(self.height_m * 1000),
            round(self.speed_m_s * 100),
            0,
            0,
            0,
        )
        return build(message, system_id=1, component_id=1, sequence=1)

    def landings(self) -> list[int]:
        """Modes that were asked for."""
        works = [one.work for one in self.sent() if isinstance(one, Transaction)]
        return [round(work.params[1] or 0) for work in works if isinstance(work, CommandWork) and work.command == 176]


def test_it_lands_once_it_stands_at_the_place() -> None:
    scene = LandScene()
    operation = scene.on_the_way()
    scene.speed_m_s = 8.0
    scene.fly(10)
    assert operation.running
    assert operation.phase == "on the way there, 111 m left: then it lands"
    assert (operation.done, operation.total) == (0, round(WAY_M))
    assert scene.landings() == []
    scene.lat = PLACE[0]
    scene.fly(5)
    assert scene.landings() == [], "it flies past"
    scene.speed_m_s = 0.2
    scene.fly(STANDS_FOR_S - 0.5)
    assert scene.landings() == []
    scene.fly(1.5)
    assert scene.landings() == [LAND]
    assert operation.phase == "landing there"
    scene.end(operation, words="The autopilot shows LAND.", seen=True)
    assert (operation.state, operation.words) == (State.DONE, "Drone 1, landing there: The autopilot shows LAND.")
    scene.fly(5)
    assert scene.landings() == []


def test_a_refused_go_to_ends_it() -> None:
    scene = LandScene()
    operation = scene.land_at()
    scene.end(operation, Outcome.REFUSED, "The autopilot denies it.")
    assert operation.state is State.REFUSED
    scene.lat = PLACE[0]
    scene.fly(10)
    assert scene.landings() == []


def test_too_high_above_the_place_is_not_there() -> None:
    scene = LandScene()
    scene.on_the_way()
    scene.lat, scene.height_m = PLACE[0], HEIGHT_M + 8
    scene.fly(20)
    assert scene.landings() == []


def mode_changes(scene: LandScene, operation: Operation) -> None:
    scene.mode = RTL


def hands_change(scene: LandScene, operation: Operation) -> None:
    scene.apply(record(1, (1,), holder=2, epoch=6))


def another_command(scene: LandScene, operation: Operation) -> None:
    scene.begin(replace(COMMAND, overrules=True))


def lands_before(scene: LandScene, operation: Operation) -> None:
    scene.flies(1, False)


def is_cancelled(scene: LandScene, operation: Operation) -> None:
    scene.service.cancel(operation)


@pytest.mark.parametrize(
    ("happens", "state", "why"),
    [
        (mode_changes, State.FAILED, "Drone 1 left the mode GUIDED."),
        (hands_change, State.CANCELLED, "The controls changed hands."),
        (another_command, State.CANCELLED, "A hold or another command came."),
        (lands_before, State.FAILED, "Drone 1 is on the ground."),
        (is_cancelled, State.CANCELLED, "It was cancelled."),
    ],
)
def test_nothing_more_is_sent_after(happens: Any, state: State, why: str) -> None:
    scene = LandScene()
    operation = scene.on_the_way()
    scene.fly(MODE_WITHIN_S + 1)
    happens(scene, operation)
    scene.sent()
    scene.fly(1)
    scene.lat, scene.mode = PLACE[0], GUIDED
    scene.fly(STANDS_FOR_S + 3)
    assert operation.state is state
    assert operation.words == f"It was stopped before this step: landing there. {why}"
    assert LAND not in scene.landings()


def test_without_news_it_does_not_land_and_a_link_that_stays_away_ends_it() -> None:
    scene = LandScene()
    operation = scene.on_the_way()
    scene.lat = PLACE[0]
    scene.fly(1)
    scene.speaks = False
    scene.fly(FRESH_S + STANDS_FOR_S + 5)
    assert scene.landings() == []
    assert operation.phase == "on the way there: its position is not known now"
    scene.agent_.link.has_channel = False
    scene.fly(LINK_PATIENCE_S + 1)
    assert operation.state is State.FAILED
    assert "The link to Drone 1 was lost on the way." in operation.words


def test_it_does_not_wait_for_ever() -> None:
    scene = LandScene()
    operation = scene.on_the_way()
    scene.fly(WAY_M + EXTRA_S + 2)
    assert operation.state is State.FAILED
    assert "did not arrive within" in operation.words


def test_a_mode_that_was_never_entered_ends_it() -> None:
    scene = LandScene()
    operation = scene.on_the_way()
    scene.mode, scene.lat = BRAKE, PLACE[0]
    scene.fly(MODE_WITHIN_S + 2)
    assert operation.state is State.FAILED
    assert scene.landings() == []


def test_a_drone_on_the_ground_is_told_so() -> None:
    scene = LandScene()
    scene.flies(1, False)
    with pytest.raises(NotInTheAir, match="take off first"):
        land_at_order(scene.drone, scene.body(), scene.now)


def test_another_flight_command_takes_its_place() -> None:
    scene = LandScene()
    first = scene.on_the_way()
    scene.fly(1)
    second = scene.on_the_way()
    scene.fly(1)
    assert first.state is State.CANCELLED
    scene.lat = PLACE[0]
    scene.fly(4)
    assert scene.landings() == [LAND]
    assert second.running
