"""Two towers on one store and one bus. All parts are real but the store, the bus and the wires.

Requests about a drone of the other tower go over the bus as in `server/towers/api`, without HTTP.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Coroutine
from typing import Any

from model_store import MemoryStore, Pause
from model_tower import ModelTower

from server.control.core.lease import TOWER as THE_TOWER
from server.control.core.lease import Changed, Event, Refused, decide
from server.control.store.lease_store import Ask as LeaseAsk
from server.control.store.lease_store import Committed
from server.control.store.service import ControlRefused
from server.kernel.access import UnknownDrone
from server.kernel.people import Principal
from server.live.live_drone import LeaseView
from server.towers.core.messages import Answer, Ask
from server.towers.core.place import Place
from server.towers.core.towers import Towers
from server.towers.core.visitors import Stop, Visitor
from server.towers.store.claims import Claims
from server.towers.store.drone_homes import AT_ANOTHER_TOWER, Claimed
from wire.ids import DroneId, UserId

MAX_ON_THE_BUS = 200


class SharedStore(MemoryStore):
    """The database of both towers: leases, homes, and which towers there are."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.homes: dict[DroneId, tuple[str, int]] = {}
        self.members: list[str] = []
        self.takes: dict[DroneId, int] = {}
        """The epoch of the last TAKE of each drone."""

    def after_start(self) -> None:
        """Each drone's home does this when it becomes that."""

    def settle(self, ask: LeaseAsk) -> Any:
        raise NotImplementedError("only StoreOfOneTower knows which tower asks")


class StoreOfOneTower:
    """`LeaseStore` and `DroneHomes` of one tower."""

    def __init__(self, store: SharedStore, tower: str) -> None:
        self._store = store
        self._tower = tower

    def __getattr__(self, name: str) -> Any:
        return getattr(self._store, name)

    def is_home(self, drone_id: DroneId) -> bool:
        return self._store.homes.get(drone_id, ("", 0))[0] == self._tower

    async def commit(self, ask: LeaseAsk) -> Committed | Refused:
        """As the transaction does: nobody claims the drone between the check of its home and the write."""
        if not self.is_home(ask.drone_id):
            await Pause()
            return AT_ANOTHER_TOWER
        before = self._store.leases[ask.drone_id]
        commit = self._store.commit(ask)
        commit.send(None)  # to the point at which others run
        await Pause()
        if not self.is_home(ask.drone_id):
            commit.close()
            return AT_ANOTHER_TOWER
        try:
            commit.send(None)
        except StopIteration as done:
            outcome: Committed | Refused = done.value
            return outcome
        assert self._store.leases[ask.drone_id].epoch == before.epoch + 1
        if ask.event is Event.TAKE and not before.offered:
            self._store.takes[ask.drone_id] = before.epoch + 1
        await Pause()
        try:
            commit.send(None)
        except StopIteration as done:
            committed: Committed | Refused = done.value
            return committed
        raise AssertionError

    async def claim(self, drone_id: DroneId, *, only_if_free: bool = False) -> Claimed | None:
        await Pause()
        store = self._store
        home, number = store.homes.get(drone_id, ("", 0))
        moved = home != self._tower
        if moved and only_if_free and home in store.members:
            return None
        if moved:
            number += 1
            store.homes[drone_id] = (self._tower, number)
            outcome = decide(store.leases[drone_id], Event.ASSIST_END, THE_TOWER)
            if isinstance(outcome, Changed):
                store._write(drone_id, outcome.lease)
        view: LeaseView = store.view(store.leases[drone_id])
        await Pause()
        return Claimed(number, moved, view, False)


class SteppedClaims(Claims):
    """The model's driver steps its work."""

    start: Callable[[Coroutine[Any, Any, Any]], None]

    def _begin(self, drone_id: DroneId) -> None:
        work: Any = self._bring_home(drone_id)
        self._at_work[drone_id] = work
        self.start(work)


class FakeBus:
    """Packets on the way, by receiver. The model loses, repeats, delays and reorders them."""

    def __init__(self) -> None:
        self.on_the_way: deque[tuple[str, bytes]] = deque(maxlen=MAX_ON_THE_BUS)

    def publish(self, tower: str, packet: bytes) -> None:
        self.on_the_way.append((tower, packet))


class OneOfSeveral(ModelTower):
    """One lifetime of one of the towers. `ask` and `open_browser` are of people who are connected to this one."""

    def __init__(self, name: str, store: SharedStore, bus: FakeBus, clock: Callable[[], float]) -> None:
        self.name = name
        self.mine = StoreOfOneTower(store, name)
        self.own: Any = self.mine
        super().__init__(self.own, clock)
        self._bus = bus
        self.towers = Towers(name, self.hub, publish=bus.publish, begin_writing=self._begin_writing)
        self._visitors: list[Visitor] = []
        self.claims = SteppedClaims(
            homes=self.own,
            towers=self.towers,
            hub=self.hub,
            service=self.service,
            loss_checks=self.event_handler._loss_checks,
            event_handler=self.event_handler,
            monotonic=clock,
        )
        self.claims.start = self._start
        self.hub.state.on_event = self.claims.noticed
        self.towers.on_ask, self.towers.on_answer = self._asked, self._answered
        self._asks = 0
        self._asked_takes: dict[int, DroneId] = {}
        self.answered_takes: list[tuple[DroneId, int]] = []
        """Drone and epoch of each TAKE that the other tower has answered as done."""
        for drone in self.hub.state.drones.values():
            drone.place = Place.NOWHERE
        self.learn()

    # -- bus ---------------------------------------------------------------------------------------------------

    def set_members(self) -> None:
        self.towers.set_members(self.mine.members, self._clock())

    def learn(self) -> None:
        """Reads all homes, as at start."""
        for drone_id, (tower, number) in self.mine.homes.items():
            self.towers.learn_homes(tower, [(drone_id, number)], self._clock())

    def receive(self, packet: bytes) -> None:
        self.towers.receive(packet, self._clock())
        self.flush()

    def flush(self) -> None:
        self.towers.flush(self._clock())

    def tick(self) -> None:
        super().tick()
        self.towers.tick(self._clock())
        for visitor in self._visitors:
            visitor.take_events()
            visitor.outbox.take(self._clock())

    def read_fleet(self) -> None:
        self.hub.apply_fleet(self.mine.snapshot())
        self.towers.visitors.fleet_changed(self._clock())
        self.flush()

    def check_links(self) -> None:
        self.claims.check_links(self._clock())

    def _begin_writing(self, visitor: Visitor) -> Stop:
        self._visitors.append(visitor)
        return lambda: self._visitors.remove(visitor)

    # -- people ------------------------------------------------------------------------------------------------

    def open_browser(self, user_id: UserId) -> None:
        super().open_browser(user_id)
        self.flush()

    def send_sticks(self, user_id: UserId, drone_id: DroneId, *, centred: bool) -> None:
        super().send_sticks(user_id, drone_id, centred=centred)
        self.flush()

    def ask(self, user_id: UserId, drone_id: DroneId, event: Event, *, watch: bool) -> None:
        """At the home, or there over the bus."""
        drone = self.hub.state.drones[drone_id]
        if drone.place is Place.NOWHERE:
            self._start(self._claim_and_ask(user_id, drone_id, event, watch=watch))
            return
        if drone.place is Place.HERE:
            super().ask(user_id, drone_id, event, watch=watch)
            return
        home = self.towers.home_of(drone_id)
        if drone.place is not Place.ELSEWHERE or home is None:
            return  # refused in words
        self._asks += 1
        if event is Event.TAKE:
            self._asked_takes[self._asks] = drone_id
        body = json.dumps({"user": user_id, "drone": drone_id, "event": event.value, "watch": watch}).encode()
        self.towers.send(home, Ask(self._asks, "POST", "", b"", [], "", body))
        self.flush()

    async def _claim_and_ask(self, user_id: UserId, drone_id: DroneId, event: Event, *, watch: bool) -> None:
        await self.claims.claim_free(drone_id)
        self.learn()
        if self.hub.state.drones[drone_id].place is Place.HERE:
            await self._change(self._principal(user_id), drone_id, event, watch=watch)

    async def _change(self, by: Principal, drone_id: DroneId, event: Event, *, watch: bool) -> None:
        await self.service.change(
            by, drone_id, event, reason="", address="", now=self._clock(), watch=watch, sticks_centred=True
        )

    def _asked(self, tower: str, ask: Ask) -> None:
        wanted = json.loads(ask.body)
        if not self.mine.accounts[UserId(wanted["user"])].disabled:
            self._start(self._carry_out_for(tower, ask.number, wanted))

    async def _carry_out_for(self, tower: str, number: int, wanted: dict[str, Any]) -> None:
        drone_id, event = DroneId(wanted["drone"]), Event(wanted["event"])
        drone = self.hub.state.drones[drone_id]
        if drone.place is not Place.HERE:
            self._answer(tower, Answer(number, 503, [], b"", False))
            return
        offered = drone.lease.offered  # an admin who takes back what they offered has the drone already
        link, ordered = drone.link, self.hub.state.traffic.holds_ordered
        try:
            await self._change(self._principal(UserId(wanted["user"])), drone_id, event, watch=wanted["watch"])
        except (ControlRefused, UnknownDrone):
            self._answer(tower, Answer(number, 409, [], b"", False))
            return
        # No await since the lease was applied.
        if event is Event.TAKE and not offered:
            assert self.hub.state.traffic.holds_ordered > ordered or drone.link is None or drone.link is not link
        self._answer(tower, Answer(number, 200, [], b"%d" % drone.lease.epoch, False))

    def _answer(self, tower: str, answer: Answer) -> None:
        self.towers.send(tower, answer)
        self.flush()

    def _answered(self, tower: str, answer: Answer) -> None:
        drone_id = self._asked_takes.pop(answer.number, None)
        if drone_id is not None and answer.status == 200:
            self.answered_takes.append((drone_id, int(answer.body)))
