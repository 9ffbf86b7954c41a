"""A drone that follows its pilot: the tower's preconditions, its reports to the agent, and the ends."""

from typing import Any

import pytest
from hub_world import NAMES
from test_follow_feed import FollowScene, lend, principal

from server.airspace.core.separation.motion import METRES_PER_DEGREE
from server.kernel.people import UserRef
from server.live.live_messages import PersonFix
from server.operations.core.flying.bodies import FollowMe
from server.operations.core.flying.follow_me import follow_me_order
from server.operations.core.flying.following import CannotFollow
from server.operations.core.operation import Operation, State
from server.operations.core.refusals import AgentTooOld, DroneBusy, LoanForbids
from wire.dialect import build, mavlink
from wire.following import FOLLOW, FOLLOW_PERSON, PERSON_PATIENCE_S, FollowWork
from wire.ids import DroneId, UserId
from wire.lateness import stamp_ms
from wire.transactions import TRANSACTIONS, CancelTransaction, Outcome

DRONE_LAT = 47.001
"""Position of drone 1 in FollowScene: 20 m above home."""


class PersonScene(FollowScene):
    """alice stands 30 m south of drone 1, which she holds."""

    def __init__(self) -> None:
        super().__init__()
        for agent in self.agents.values():
            agent.link.takes = frozenset((TRANSACTIONS, FOLLOW, FOLLOW_PERSON))
        self.phone = self.browser(1)

    def lat(self, south_m: float) -> float:
        return DRONE_LAT - south_m / METRES_PER_DEGREE

    def follow_me(self, south_m: float = 30.0, by: int = 1, drone: int = 1, **request: Any) -> Operation:
        follower = self.hub.state.drones.get(DroneId(drone))
        assert follower is not None
        fields = {"lat": self.lat(south_m), "lon": 8.0, "accuracy_m": 4.0} | request
        body = FollowMe(command="follow_me", **fields)
        order, following = follow_me_order(self.hub, principal(by), follower, body, self.now)
        operation = self.service.begin(follower, order, by=UserRef(UserId(by), NAMES[by]), now=self.now)
        self.hub.follows.began(operation, following)
        return operation

    def fix(self, south_m: float, *, accuracy_m: float = 4.0, age_ms: float = 200.0, late_s: float = 0.0) -> None:
        reported = PersonFix(1, self.lat(south_m), 8.0, accuracy_m, age_ms, stamp_ms(self.now + 50.0 - late_s))
        self.hub.person_fix(self.phone.browser, reported, self.now)


def test_it_stays_on_its_side_of_the_person_at_its_own_height() -> None:
    scene = PersonScene()
    operation = scene.follow_me()
    (sent,) = scene.sent()
    assert isinstance(sent.work, FollowWork)
    assert sent.work.leader_name == "alice"
    assert sent.work.north_m == pytest.approx(15.05, abs=0.01)
    assert sent.work.east_m == pytest.approx(0.0, abs=0.01)
    assert (sent.work.up_m, sent.work.patience_s) == (0.0, PERSON_PATIENCE_S)
    assert operation.order.work == "follow_me"
    assert "lat" not in operation.order.about
    scene.tick()
    (reported,) = scene.heard_by()
    assert reported.lat_e7 == round(scene.lat(30.0) * 1e7)
    assert (reported.alt_amsl_mm, reported.airborne) == (500_001, True)
    scene.tick(1.0)
    scene.heard_by()
    scene.fix(33.0)
    scene.tick()
    scene.tick()
    reported = scene.heard_by()[-1]
    assert reported.lat_e7 == round(scene.lat(33.0) * 1e7)
    assert reported.age_ms == pytest.approx(400, abs=110)
    scene.end(operation, Outcome.FAILED, "It no longer follows alice: nothing new. It holds in BRAKE.")
    assert operation.words == "Drone 1: It no longer follows alice: nothing new. It holds in BRAKE."


def test_what_does_not_count_gets_old_and_what_was_held_up_is_old() -> None:
    scene = PersonScene()
    scene.follow_me()
    scene.tick(1.0)
    scene.fix(31.0, age_ms=0.0)  # on time
    scene.tick(1.0)
    scene.fix(32.0, accuracy_m=15.5)
    scene.tick(1.0)
    assert scene.heard_by()[-1].age_ms == pytest.approx(2000, abs=110)
    scene.fix(32.0, late_s=1.5, age_ms=0.0)
    scene.tick(0.2)
    assert scene.heard_by()[-1].age_ms == pytest.approx(1700, abs=110)


def test_where_nobody_is_followed_a_fix_is_nothing() -> None:
    scene = PersonScene()
    scene.fix(30.0)
    scene.follow()
    scene.tick()
    scene.fix(30.0)
    scene.tick(0.3)
    assert scene.heard_by()[-1].lat_e7 == 470_020_000, "of the drone that leads"


def test_the_browser_that_is_gone_ends_it_and_another_one_does_not() -> None:
    scene = PersonScene()
    operation = scene.follow_me()
    scene.tick(1.0)
    scene.fix(30.5)
    scene.sent()
    scene.hub.detach_browser(scene.watcher.browser, scene.now)
    assert scene.sent() == []
    scene.hub.detach_browser(scene.phone.browser, scene.now)
    assert scene.sent() == [CancelTransaction(id=operation.transaction_id)]
    scene.end(operation, Outcome.CANCELLED, "It was ordered to follow alice no more. It holds in BRAKE.")
    assert operation.state is State.CANCELLED
    assert operation.words.startswith("Drone 1: the browser of alice is gone. It was ordered")


def test_it_must_be_high_enough_and_neither_too_near_nor_too_far() -> None:
    for south_m, words in ((7.0, "7 m from you, over ground"), (101.0, "101 m from you")):
        with pytest.raises(CannotFollow, match=words):
            PersonScene().follow_me(south_m)
    scene = PersonScene()
    with pytest.raises(CannotFollow, match="accurate to 16 m only: Drone 1 needs 15 m"):
        scene.follow_me(accuracy_m=16.0)
    with pytest.raises(CannotFollow, match="measured 4 s ago"):
        scene.follow_me(age_ms=4000.0)
    scene.flies(1, False)
    with pytest.raises(CannotFollow, match="not in the air"):
        scene.follow_me()
    scene = PersonScene()
    scene.now = 2.5
    with pytest.raises(CannotFollow, match="no position of Drone 1 within 2 s"):
        scene.follow_me()


def test_it_must_be_so_high_that_a_wrong_fix_is_above_the_person() -> None:
    scene = PersonScene()
    for up_m, is_high_enough in ((7.9, False), (8.0, True)):
        low = mavlink.MAVLink_global_position_int_message(
            5, 470_010_000, 80_000_000, 488_000, round(up_m * 1000), 0, 0, 0, 0
        )
        scene.agents[1].send(build(low, system_id=1, component_id=1, sequence=1))
        if is_high_enough:
            assert scene.follow_me().running
        else:
            with pytest.raises(CannotFollow, match=r"7\.9 m above home: 8 m is the minimum"):
                scene.follow_me()


def test_an_agent_that_knows_drones_only_is_not_asked() -> None:
    scene = PersonScene()
    scene.agent_.link.takes = frozenset((TRANSACTIONS, FOLLOW))
    with pytest.raises(AgentTooOld):
        scene.follow_me()


def test_one_drone_follows_a_person_and_nobody_follows_that_drone() -> None:
    scene = PersonScene()
    scene.follow_me()
    with pytest.raises(DroneBusy, match="Drone 1 follows alice"):
        scene.follow_me()
    with pytest.raises(CannotFollow, match="another drone follows you already"):
        scene.follow_me(south_m=-70.0, drone=2)
    with pytest.raises(CannotFollow, match="Drone 1 follows alice itself"):
        scene.follow(3, 1)


def test_the_limits_of_a_loan_hold_for_it_too() -> None:
    scene = PersonScene()
    lend(scene, 15.0, None)
    with pytest.raises(LoanForbids):
        scene.follow_me(by=2)
