"""A real hub, service and event handler over a store in memory. Nothing runs by itself: the driver takes each step."""

from collections import deque
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from typing import Any

from model_agent import stick_frame
from model_store import MemoryStore

from server.control.core.lease import Event, Refused
from server.control.store.hub_event_handler import HubEventHandler
from server.control.store.lease_store import Ask, Committed
from server.control.store.loss_checks import LossChecks
from server.control.store.rehearsal import Rehearsals
from server.control.store.service import ControlRefused, ControlService
from server.kernel.access import UnknownDrone
from server.kernel.people import Principal, Role, UserRef
from server.live.browser import Browser
from server.live.hub import Hub
from server.live.hub_events import HubEvent
from wire.ids import DroneId, UserId
from wire.tagged import tag

LATER = datetime(2100, 1, 1, tzinfo=UTC)


class NoDatabase:
    """The audit trail of a world without a database."""

    @asynccontextmanager
    async def writing(self) -> AsyncIterator[Any]:
        yield self

    @asynccontextmanager
    async def reading(self) -> AsyncIterator[Any]:
        yield self

    async def scalars(self, statement: object) -> list[Any]:
        return []

    async def execute(self, statement: object) -> None:
        """Changes nothing."""

    async def get(self, table: object, key: object) -> None:
        """Has no rows."""

    def add(self, row: object) -> None:
        """Keeps nothing."""


class SteppedEventHandler(HubEventHandler):
    """The model's driver empties its queue, not tasks."""

    def __init__(self, **parts: Any) -> None:
        super().__init__(**parts)
        self.noticed_events: deque[HubEvent] = deque()

    def _queue(self, event: HubEvent) -> None:
        if event not in self.noticed_events:
            self.noticed_events.append(event)

    def carry_out(self, event: HubEvent) -> Coroutine[Any, Any, None]:
        return self._carry_out(event)


class SteppedService(ControlService):
    """Its store always decides. Other tests cover a store that does not."""

    async def _decided(self, ask: Ask, *, fenced: bool, by: UserRef | None, now: float) -> Committed | Refused:
        return await self._store.commit(ask)


class ModelTower:
    """One lifetime of the tower's process."""

    def __init__(self, store: MemoryStore, clock: Callable[[], float]) -> None:
        self.store = store
        self._clock = clock
        self.hub = Hub()
        database: Any = NoDatabase()
        parts: dict[str, Any] = {"hub": self.hub, "database": database, "clock": lambda: LATER}
        checks = LossChecks(**parts)
        self.service = SteppedService(store, self.hub, on_changed=checks.recheck)
        self.event_handler = SteppedEventHandler(
            **parts, service=self.service, loss_checks=checks, rehearsals=Rehearsals(**parts), monotonic=clock
        )
        self.hub.state.on_event = self.event_handler.noticed
        self.browsers: dict[UserId, Browser] = {}
        self.running: list[Coroutine[Any, Any, Any]] = []
        store.after_start()
        self.hub.apply_fleet(store.snapshot())

    def ask(self, user_id: UserId, drone_id: DroneId, event: Event, *, watch: bool) -> None:
        account = self.store.accounts[user_id]
        if account.disabled:
            return
        self._start(
            self.service.change(
                self._principal(user_id),
                drone_id,
                event,
                reason="",
                address="",
                now=self._clock(),
                watch=watch,
                sticks_centred=True,
            )
        )

    def see_to_next_event(self) -> None:
        if self.event_handler.noticed_events:
            self._start(self.event_handler.carry_out(self.event_handler.noticed_events.popleft()))

    def step(self, number: int) -> None:
        """Resumes one of the tasks that wait for the database."""
        if self.running:
            self._go_on(self.running[number % len(self.running)])

    def settle(self) -> None:
        while self.running or self.event_handler.noticed_events:
            self.see_to_next_event()
            self.step(0)

    def die(self) -> None:
        """Simulates kill -9: committed writes stay, and no one is notified."""
        for coroutine in self.running:
            coroutine.close()
        self.running.clear()

    def open_browser(self, user_id: UserId) -> None:
        if user_id in self.browsers or self.store.accounts[user_id].disabled:
            return
        browser = Browser(
            self.hub.next_browser_number(),
            self._principal(user_id),
            self._clock(),
            wake=lambda: None,
            close=lambda code, why: self.close_browser(user_id),
        )
        self.browsers[user_id] = browser
        self.hub.attach_browser(browser, "", self._clock())

    def close_browser(self, user_id: UserId) -> None:
        browser = self.browsers.pop(user_id, None)
        if browser is not None:
            self.hub.detach_browser(browser, self._clock())

    def sign_out(self, user_id: UserId) -> None:
        self.hub.end_user(user_id, "the account was disabled")

    def send_sticks(self, user_id: UserId, drone_id: DroneId, *, centred: bool) -> None:
        browser = self.browsers.get(user_id)
        if browser is not None:
            frame = tag(drone_id, stick_frame(user_id, centred=centred))
            self.hub.frames_from_browser(browser, frame, self._clock())
            browser.take_events()

    def tick(self) -> None:
        now = self._clock()
        self.hub.tick(now)
        for browser in self.browsers.values():
            browser.take_events()
            browser.outbox.take(now)

    def _principal(self, user_id: UserId) -> Principal:
        account = self.store.accounts[user_id]
        return Principal(user_id, account.name, Role(account.role), user_id, LATER)

    def _start(self, coroutine: Coroutine[Any, Any, Any]) -> None:
        self.running.append(coroutine)
        self._go_on(coroutine)

    def _go_on(self, coroutine: Coroutine[Any, Any, Any]) -> None:
        try:
            coroutine.send(None)
        except (StopIteration, ControlRefused, UnknownDrone):
            self.running.remove(coroutine)
