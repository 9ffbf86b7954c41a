"""An undecided TAKE: the fence stays until the database reports who has the controls, whatever happens to the
request."""

import asyncio
from typing import Any

from server.control.core.lease import Event
from server.control.store.lease_store import Ask
from server.control.store.undecided import UndecidedTakes
from server.live.live_drone import LeaseView
from server.storage.database_wait import current_wait, waiting_at_most
from wire.ids import DroneId

DRONE = DroneId(1)


class Store:
    """Records what was settled, and its order relative to the commit."""

    def __init__(self) -> None:
        self.happened: list[str] = []

    async def settle(self, ask: Ask) -> LeaseView:
        self.happened.append(f"settled {ask.reason}")
        assert current_wait() is None, "what a request left behind is not in its hurry"
        return LeaseView(holder=None, taken_from=None, epoch=0)


class World:
    def __init__(self) -> None:
        self.store, self.fences = Store(), 0
        hub: Any = _Hub()
        store: Any = self.store
        self.takes = UndecidedTakes(store, hub, fence=self._fence, unfence=self._unfence)

    def _fence(self, drone_id: DroneId) -> None:
        self.fences += 1

    def _unfence(self, drone_id: DroneId) -> None:
        self.fences -= 1

    def ask(self, reason: str) -> Ask:
        return Ask(drone_id=DRONE, event=Event.TAKE, by=None, reason=reason, began_at=0.0)


class _Hub:
    def __init__(self) -> None:
        self.state, self.changes = self, self
        self.drones: dict[DroneId, object] = {}
        self.reported: list[str] = []

    def notify_undecided(self, drone_id: DroneId, severity: str, words: str) -> None:
        self.reported.append(words)


async def _commit_that_ends_late(world: World, let_end: asyncio.Event) -> Any:
    try:
        await asyncio.Event().wait()
    except asyncio.CancelledError:
        await let_end.wait()  # a driver that waits for a frozen server
        world.store.happened.append("commit ended")
        raise


async def test_the_lease_is_read_only_when_the_commit_can_change_it_no_more() -> None:
    world, let_end = World(), asyncio.Event()
    committing = asyncio.create_task(_commit_that_ends_late(world, let_end))
    await asyncio.sleep(0)
    world.takes.wait_for_decision(world.ask("first"), None, 0.0, committing)
    for _ in range(20):
        await asyncio.sleep(0)
    assert world.store.happened == []
    assert world.fences == 1
    let_end.set()
    for _ in range(20):
        await asyncio.sleep(0)
    assert world.store.happened == ["commit ended", "settled first"]
    assert world.fences == 0


async def test_each_take_is_settled_and_one_fence_stays_for_all() -> None:
    world, let_end = World(), asyncio.Event()
    for reason in ("first", "second"):
        committing = asyncio.create_task(_commit_that_ends_late(world, let_end))
        await asyncio.sleep(0)
        world.takes.wait_for_decision(world.ask(reason), None, 0.0, committing)
        await asyncio.sleep(0)
    assert world.fences == 1
    let_end.set()
    for _ in range(40):
        await asyncio.sleep(0)
    assert world.store.happened[-2:] == ["settled first", "settled second"]
    assert world.fences == 0


async def test_what_a_request_leaves_behind_has_all_the_time_it_needs() -> None:
    world = World()
    with waiting_at_most(0.0):
        committing: asyncio.Task[Any] = asyncio.create_task(asyncio.sleep(0))
        world.takes.wait_for_decision(world.ask("first"), None, 0.0, committing)
    for _ in range(20):
        await asyncio.sleep(0)
    assert world.store.happened == ["settled first"]
    assert world.fences == 0
