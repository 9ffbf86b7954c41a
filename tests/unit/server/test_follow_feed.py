"""The tower's reports on the leader to a follower's agent, and when the tower itself ends them."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hub_world import LATER, NAMES, FakeAgent, record
from operation_scene import Scene

from server.control.core.loan_limits import Home
from server.kernel.fleet import LoanRecord
from server.kernel.people import Principal, Role, UserRef
from server.operations.core.flying.bodies import Follow
from server.operations.core.flying.following import CannotFollow, NoSuchLeader, follow_order
from server.operations.core.operation import Operation, State
from server.operations.core.refusals import AgentTooOld, DroneBusy, LoanForbids
from wire.control_messages import AutopilotState, decode_to_agent
from wire.dialect import build, mavlink
from wire.following import FOLLOW, FollowWork, LeaderPosition
from wire.ids import DroneId, UserId
from wire.transactions import TRANSACTIONS, CancelTransaction, CommandWork, Outcome, Transaction

OWNERS = {1: (1,), 2: (1, 2), 3: (1,)}


def principal(user_id: int = 1) -> Principal:
    role = Role.ADMIN if user_id == 9 else Role.OPERATOR
    return Principal(UserId(user_id), NAMES[user_id], role, user_id, LATER)


def position(lat_e7: int, alt_mm: int, north_cm_s: int = 0) -> bytes:
    message = mavlink.MAVLink_global_position_int_message(5, lat_e7, 80000000, alt_mm, 20000, north_cm_s, 0, -50, 0)
    return build(message, system_id=1, component_id=1, sequence=1)


def beat(mode: int = 4) -> bytes:
    return build(mavlink.MAVLink_heartbeat_message(2, 3, 81, mode, 4, 3), system_id=1, component_id=1, sequence=2)


class FollowScene(Scene):
    """Drone 1, held by alice, is to follow drone 2. All three are in the air, 100 m apart."""

    def __init__(self) -> None:
        super().__init__(takes=(TRANSACTIONS, FOLLOW))
        self.own()
        self.agents: dict[int, FakeAgent] = {1: self.agent_}
        for number in (2, 3):
            self.agents[number] = self.agent(number)
            self.agents[number].link.takes = frozenset((TRANSACTIONS, FOLLOW))
        for number, agent in self.agents.items():
            agent.send(beat())
            agent.send(position(470_000_000 + number * 10_000, 500_000 + number, 300))
            self.flies(number, True)
            agent.received()

    def own(self, **changes: Any) -> None:
        records = [replace(record(number, owners, holder=1, epoch=5), **changes) for number, owners in OWNERS.items()]
        self.apply(*records)

    def flies(self, number: int, airborne: bool) -> None:
        reported = AutopilotState(heard=True, armed=airborne, airborne=airborne)
        self.hub.reports.receive(self.agents[number].link, reported)

    def follow(self, drone: int = 1, leader: int = 2, north_m: float = -20.0, by: int = 1, **more: Any) -> Operation:
        follower = self.hub.state.drones.get(DroneId(drone))
        assert follower is not None
        request = Follow(command="follow", leader=leader, north_m=north_m, **more)
        order, following = follow_order(self.hub, principal(by), follower, request, self.now)
        operation = self.service.begin(follower, order, by=UserRef(UserId(by), NAMES[by]), now=self.now)
        self.hub.follows.began(operation, following)
        return operation

    def tick(self, seconds: float = 0.1) -> None:
        self.now += seconds
        self.service.tick(self.now)
        self.hub.follows.tick(self.now)

    def heard_by(self, number: int = 1) -> list[LeaderPosition]:
        """Returns the leader reports to its agent over the data channel."""
        agent = self.agents[number]
        sent, agent.sent_to = agent.sent_to, []
        urgent = [agent.sealed.receive(datagram, self.now).urgent for datagram, _ in sent]
        reported = [decode_to_agent(text) for text in urgent if text is not None]
        return [one for one in reported if isinstance(one, LeaderPosition)]


def test_its_agent_hears_of_the_leader_five_times_a_second() -> None:
    scene = FollowScene()
    operation = scene.follow()
    (sent,) = scene.sent()
    assert sent.work == FollowWork("Drone 2", -20.0, 0.0, 0.0)
    assert (sent.epoch, sent.deadline_s) == (5, 600.0)
    for _ in range(20):
        scene.tick()
    reported = scene.heard_by()
    assert len(reported) in (10, 11)
    assert [one.number for one in reported] == list(range(1, len(reported) + 1))
    last = reported[-1]
    assert (last.id, last.lat_e7, last.lon_e7, last.alt_amsl_mm) == (sent.id, 470_020_000, 80_000_000, 500_002)
    assert (last.north_cm_s, last.east_cm_s, last.down_cm_s, last.airborne) == (300, 0, -50, True)
    assert last.age_ms == pytest.approx(1900, abs=110)
    assert not [one for one in scene.agent_.posted if isinstance(one, LeaderPosition)], "not where it could queue"
    scene.end(operation, Outcome.FAILED, "It holds in BRAKE.")
    assert (operation.state, operation.words) == (State.FAILED, "Drone 1: It holds in BRAKE.")
    scene.tick(1.0)
    assert scene.heard_by() == []


def test_a_leader_that_landed_is_told_and_one_that_is_not_heard_gets_old() -> None:
    scene = FollowScene()
    scene.follow()
    scene.flies(2, False)
    scene.tick()
    assert scene.heard_by()[-1].airborne is False
    scene.flies(2, True)
    scene.hub.reports.receive(scene.agents[2].link, AutopilotState(heard=False, armed=False, airborne=False))
    scene.tick(3.0)
    (reported,) = scene.heard_by()
    assert (reported.airborne, reported.age_ms > 3000) == (True, True)


def test_first_the_mode_that_listens_and_nothing_is_told_before() -> None:
    scene = FollowScene()
    scene.agent_.send(beat(mode=5))
    scene.agent_.received()
    operation = scene.follow()
    (sent,) = scene.sent()
    assert isinstance(sent.work, CommandWork)
    assert (sent.work.command, sent.work.params[:2]) == (176, (1.0, 4))
    scene.tick()
    assert scene.heard_by() == []
    scene.end(operation)
    assert isinstance(scene.sent()[0].work, FollowWork)
    scene.tick(0.3)
    assert len(scene.heard_by()) == 1


def loses_sight(scene: FollowScene) -> None:
    OWNERS_NOW = {1: (1,), 2: (2,), 3: (1,)}
    scene.apply(*[record(number, owners, holder=1, epoch=5) for number, owners in OWNERS_NOW.items()])


def is_removed(scene: FollowScene) -> None:
    scene.apply(record(1, (1,), holder=1, epoch=5))


@pytest.mark.parametrize("what", [loses_sight, is_removed])
def test_who_may_not_see_the_leader_any_more_follows_it_no_more(what: Callable[[FollowScene], None]) -> None:
    scene = FollowScene()
    operation = scene.follow()
    scene.tick()
    scene.heard_by()
    scene.sent()
    what(scene)
    scene.tick(0.3)
    assert scene.sent() == [CancelTransaction(id=operation.transaction_id)]
    assert scene.heard_by() == []
    scene.end(operation, Outcome.CANCELLED, "It was ordered to follow Drone 2 no more. It holds in BRAKE.")
    assert operation.words.startswith("Drone 1: Drone 2 is not yours to see any more. It was ordered")


def lend(scene: FollowScene, height_m: float | None, radius_m: float | None) -> None:
    loan = LoanRecord(UserRef(UserId(2), "bob"), LATER, True, height_m, radius_m)
    scene.apply(
        replace(record(1, (1,), holder=2, epoch=6), loans=(loan,)),
        record(2, (2,), epoch=5),
        record(3, (1,), epoch=5),
    )
    scene.drone.home = Home(47.0, 8.0, 480.0)


def test_the_place_stays_within_the_limits_of_a_loan() -> None:
    scene = FollowScene()
    lend(scene, 30.0, 400.0)
    operation = scene.follow(by=2)
    scene.tick()
    scene.sent()
    scene.agents[2].send(position(470_020_000, 515_000), now=scene.now)
    scene.tick(0.3)
    assert scene.sent() == [CancelTransaction(id=operation.transaction_id)]
    scene.end(operation, Outcome.CANCELLED, "It holds in BRAKE.")
    assert operation.words == "Drone 1: the place is above the 30 m of the loan. It holds in BRAKE."
    for height_m, radius_m in ((30.0, None), (None, 150.0)):
        lend(scene, height_m, radius_m)
        with pytest.raises(LoanForbids):
            scene.follow(by=2)
    scene.drone.home = None
    with pytest.raises(LoanForbids):
        scene.follow(by=2)


def test_nobody_follows_one_that_follows_nor_itself_nor_one_on_the_ground() -> None:
    scene = FollowScene()
    scene.follow(1, 2)
    with pytest.raises(DroneBusy, match="Drone 1 follows Drone 2"):
        scene.follow(1, 3)
    with pytest.raises(CannotFollow, match="Drone 1 follows Drone 2 itself"):
        scene.follow(3, 1)
    with pytest.raises(CannotFollow, match="Drone 2 is followed"):
        scene.follow(2, 3)
    with pytest.raises(CannotFollow, match="too near to another drone that follows"):
        scene.follow(3, 2, east_m=5.0)
    assert scene.follow(3, 2, east_m=12.0).running
    scene = FollowScene()
    with pytest.raises(CannotFollow, match="itself"):
        scene.follow(1, 1)
    for number, words in ((2, "Drone 2 is not in the air"), (1, "Drone 1 is not in the air")):
        scene.flies(number, False)
        with pytest.raises(CannotFollow, match=words):
            scene.follow()
    scene = FollowScene()
    scene.now = 2.5
    with pytest.raises(CannotFollow, match="no position of Drone 2 within 2 s"):
        scene.follow()


def test_who_may_not_see_it_hears_that_there_is_none() -> None:
    scene = FollowScene()
    loses_sight(scene)
    for leader in (2, 77):
        with pytest.raises(NoSuchLeader):
            scene.follow(leader=leader)


def test_an_agent_that_does_not_know_how_is_not_asked() -> None:
    scene = FollowScene()
    scene.agent_.link.takes = frozenset((TRANSACTIONS,))
    with pytest.raises(AgentTooOld):
        scene.follow()
    assert not [one for one in scene.agent_.posted if isinstance(one, Transaction)]


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (5.0, 5.0, 0.0), (0.0, 0.0, -7.9)])
def test_a_place_too_near_is_none(place: tuple[float, float, float]) -> None:
    north_m, east_m, up_m = place
    with pytest.raises(CannotFollow, match="too near to Drone 2: 8 m away"):
        FollowScene().follow(north_m=north_m, east_m=east_m, up_m=up_m)
