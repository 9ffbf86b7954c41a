"""What the model of two towers consists of: the towers, a bus, agents that move, and notes of who flew."""

from collections import deque
from typing import Any

from model_agent import ModelAgent
from model_store import Account
from model_tower import LATER
from model_towers import FakeBus, OneOfSeveral, SharedStore

from server.control.core.lease import Lease
from server.kernel.people import Role
from server.live.hub import Hub
from wire.control_messages import HoldOrder, ToAgent, ToTower
from wire.ids import DroneId, LinkId, UserId
from wire.open_holds import OPEN_HOLDS, HoldState

ALICE, BOB, ROOT, TOOR = UserId(1), UserId(2), UserId(8), UserId(9)
EVERYBODY = (ALICE, BOB, ROOT, TOOR)
ONE, TWO = DroneId(1), DroneId(2)
MAX_IN_FLIGHT = 60
A, B = 0, 1


class MovingAgent(ModelAgent):
    """Links to one tower or the other. What a former tower still sends on its link does not arrive."""

    takes = (OPEN_HOLDS,)
    held_at = 0
    """The newest epoch in which a hold was ordered, over all links."""

    def connect(self, hub: Hub, link_id: LinkId, network: deque[tuple[DroneId, bytes]], now: float) -> None:
        self.control = deque()
        super().connect(hub, link_id, network, now)

    def _announce(self, hub: Hub, message: ToTower, now: float) -> None:
        if isinstance(message, HoldState) and self.link is not None:
            hub.reports.receive(self.link, message, LATER)
        else:
            super()._announce(hub, message, now)

    def _message(self, message: ToAgent, now: float) -> None:
        if isinstance(message, HoldOrder):
            self.held_at = max(self.held_at, message.epoch)
        super()._message(message, now)


class TwoTowers:
    """Tower A is at 0, B at 1."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.links = self.lives = 0
        self.network: deque[tuple[DroneId, bytes]] = deque(maxlen=MAX_IN_FLIGHT)
        self.bus = FakeBus()
        self.store = SharedStore(
            {
                ALICE: Account("alice", Role.OPERATOR, {ONE, TWO}),
                BOB: Account("bob", Role.OPERATOR, {ONE}),
                ROOT: Account("root", Role.ADMIN, set()),
                TOOR: Account("toor", Role.ADMIN, set()),
            },
            {ONE: Lease(), TWO: Lease()},
        )
        self.frozen = [False, False]
        self.towers = [self._new_tower(), self._new_tower()]
        self.agents = {drone_id: MovingAgent(drone_id, self.now) for drone_id in (ONE, TWO)}
        self.at: dict[DroneId, int | None] = {ONE: None, TWO: None}
        self.flown: dict[tuple[DroneId, int], set[int]] = {}
        self.newest: dict[DroneId, int] = {ONE: 0, TWO: 0}

    def _new_tower(self) -> OneOfSeveral:
        self.lives += 1
        name = f"{self.lives:032x}"
        self.store.members.append(name)
        return OneOfSeveral(name, self.store, self.bus, lambda: self.now)

    def _meet(self) -> None:
        for number in (A, B):
            self.towers[number].set_members()
        for _ in range(12):
            self._time_passes(0.1)
            self._deliver_all()

    def _runs(self, number: int) -> bool:
        return not self.frozen[number]

    def _time_passes(self, seconds: float) -> None:
        self.now += seconds
        for drone_id, agent in self.agents.items():
            number = self.at[drone_id]
            if number is not None and self._runs(number):
                agent.speak(self.towers[number].hub, self.now)
            agent.tick(self.now)
        for number, tower in enumerate(self.towers):
            if self._runs(number):
                tower.tick()

    def _is_frozen(self, name: str) -> bool:
        return any(tower.name == name and self.frozen[number] for number, tower in enumerate(self.towers))

    def _deliver(self, to: str, packet: bytes) -> None:
        for number, tower in enumerate(self.towers):
            if tower.name == to and self._runs(number):
                tower.receive(packet)

    def _deliver_all(self) -> None:
        for _ in range(500):
            waiting = [one for one in self.bus.on_the_way if not self._is_frozen(one[0])]
            if not waiting:
                return
            self.bus.on_the_way = deque(
                (one for one in self.bus.on_the_way if self._is_frozen(one[0])), self.bus.on_the_way.maxlen
            )
            for to, packet in waiting:
                self._deliver(to, packet)
        raise AssertionError("the towers never stop talking")

    def _check_the_fence(self, drone_id: DroneId, tower: OneOfSeveral) -> None:
        link = self.agents[drone_id].link
        assert link is not None
        send_frames = link.send_frames

        def checked(*frames: Any) -> bool:
            assert not tower.claims.is_claiming(drone_id), "sticks passed before the claim"
            return send_frames(*frames)

        link.send_frames = checked  # type: ignore[method-assign]

    def _note_who_flew(self) -> None:
        for drone_id, agent in self.agents.items():
            for epoch, user_id in agent.flown_by:
                self.flown.setdefault((drone_id, epoch), set()).add(user_id)
                assert epoch >= self.newest[drone_id], f"drone {drone_id} went back to epoch {epoch}"
                self.newest[drone_id] = epoch
            agent.flown_by.clear()
