"""Makes this tower the home of the drones whose agents link here, and of those whose tower has ended.

A drone that comes from elsewhere is fenced until the database has accepted the claim and its lease is known here: no
commands pass before that.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Final

import structlog
from sqlalchemy.exc import SQLAlchemyError

from server.control.store.hub_event_handler import HubEventHandler
from server.control.store.loss_checks import LossChecks
from server.control.store.service import ControlService
from server.control.store.settings_store import apply_to
from server.live.hub import Hub
from server.live.hub_events import AgentLinked, HoldStepReported, HubEvent, LossParametersReported
from server.towers.core.place import Place
from server.towers.core.towers import Towers
from server.towers.store.drone_homes import Claimed, DroneHomes
from wire.ids import DroneId

TRY_AGAIN_AFTER_S: Final = 0.5
ANOTHER_TOWER: Final = "the drone has another tower now"
_OF_ITS_AGENT: Final = (AgentLinked, LossParametersReported, HoldStepReported)
_log = structlog.get_logger(__name__)


class Claims:
    """One for a tower that shares a bus."""

    def __init__(
        self,
        *,
        homes: DroneHomes,
        towers: Towers,
        hub: Hub,
        service: ControlService,
        loss_checks: LossChecks,
        event_handler: HubEventHandler,
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        self._homes = homes
        self._towers = towers
        self._hub = hub
        self._service = service
        self._loss_checks = loss_checks
        self._event_handler = event_handler
        self._monotonic = monotonic
        self._at_work: dict[DroneId, asyncio.Task[None]] = {}
        self.on_came: Callable[[DroneId], None] = lambda drone_id: None
        """Called when a drone has its home here since now."""
        towers.is_claiming = self.is_claiming

    def noticed(self, event: HubEvent) -> None:
        """In place of the event handler's: only the home of a drone acts on what the hub notices about it."""
        drone = self._hub.state.drones.get(event.drone_id)
        if drone is None:
            return
        if isinstance(event, AgentLinked):
            self.linked(event.drone_id)
        if drone.place is Place.HERE or (isinstance(event, _OF_ITS_AGENT) and drone.link is not None):
            self._event_handler.noticed(event)

    def linked(self, drone_id: DroneId) -> None:
        """The drone's agent has linked here: from this instant no commands pass, until the drone is at home here. Each
        new link asks the database again: the drone may have been elsewhere meanwhile, and this tower not know it."""
        if drone_id not in self._hub.state.drones or drone_id in self._at_work:
            return  # who is at work sees that the link is another one
        self._service.fence(drone_id)
        self._begin(drone_id)

    def is_claiming(self, drone_id: DroneId) -> bool:
        """Whether the agent has linked here, and the database has not confirmed yet that the drone is at home here."""
        return drone_id in self._at_work

    def check_links(self, now: float) -> None:
        """Once a second: a drone that is heard here and not at home here comes home."""
        for link in list(self._hub.state.links.values()):
            drone = self._hub.state.drones.get(link.drone_id)
            if drone is not None and drone.place is not Place.HERE and link.is_heard(now):
                self.linked(link.drone_id)

    async def adopt(self) -> None:
        """Once a second: takes over the drones of towers that have ended."""
        for drone_id in await self._homes.orphaned():
            await self.claim_free(drone_id)

    async def claim_free(self, drone_id: DroneId) -> None:
        """Makes this tower the home unless another running tower is. Raises DatabaseUnavailable."""
        if drone_id in self._at_work or drone_id not in self._hub.state.drones:
            return
        claimed = await self._homes.claim(drone_id, only_if_free=True)
        if claimed is not None:
            self._apply(drone_id, claimed)

    async def learn(self) -> None:
        """At start, and when the towers have changed: reads every home from the database."""
        for tower, homes in (await self._homes.all()).items():
            self._towers.learn_homes(tower, homes, self._monotonic())

    async def stop(self) -> None:
        tasks = list(self._at_work.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _begin(self, drone_id: DroneId) -> None:
        self._at_work[drone_id] = asyncio.create_task(self._bring_home(drone_id))

    async def _bring_home(self, drone_id: DroneId) -> None:
        try:
            while (drone := self._hub.state.drones.get(drone_id)) is not None and drone.link is not None:
                link = drone.link
                try:
                    claimed = await self._homes.claim(drone_id)
                    if claimed is not None:
                        self._apply(drone_id, claimed)
                except (SQLAlchemyError, OSError) as error:
                    _log.error("drone_not_claimed", drone_id=drone_id, error=type(error).__name__)
                    await asyncio.sleep(TRY_AGAIN_AFTER_S)
                    continue
                if drone.link is not link:
                    continue  # the drone may have been elsewhere since the claim
                if drone.place is not Place.HERE:
                    self._hub.end_superseded_link(drone_id)
                return
        finally:
            del self._at_work[drone_id]
            self._service.unfence(drone_id)

    def _apply(self, drone_id: DroneId, claimed: Claimed) -> None:
        drone = self._hub.state.drones.get(drone_id)
        if drone is None:
            return
        now = self._monotonic()
        if claimed.lease is not None:
            self._hub.adopt_lease(drone_id, claimed.lease, now, moved=claimed.moved)
        apply_to(self._hub, drone_id, claimed.settings)
        if claimed.moved and claimed.hold_open:
            self._hub.holds.keep(drone_id)
        well = self._towers.was_handed_over(drone_id, claimed.claim, drone.lease.epoch, now) and not claimed.hold_open
        is_flown = drone.lease.holder is not None or claimed.hold_open
        if claimed.moved and not well and drone.link is not None and is_flown:
            # What was flown elsewhere is not known here. Before anybody's commands pass.
            self._hub.holds.order(drone_id, ANOTHER_TOWER)
        self._towers.claimed([(drone_id, claimed.claim)], now)
        # Only now: events about drones that are not at home here are dropped.
        self._hub.fleet.check_lease(drone_id)
        if claimed.moved:
            self.on_came(drone_id)
        self._loss_checks.learn(drone_id, claimed.acknowledged)
