"""Takes over the alerts of drones that come to this tower from another one, which has ended or has handed them over.

The stored alerts are the way: an alert that is open there, whose drone is at home here, and which this tower does not
have, was another tower's. It goes on here under its number, so it ends here, and everything about it is announced once.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from itertools import islice
from typing import Final

import structlog
from sqlalchemy.exc import SQLAlchemyError

from server.alerts.core.alert import Alert
from server.alerts.core.announcer import Announcer
from server.alerts.store.loading import read_alerts, read_open, restore_alerts
from server.alerts.store.writer import AlertWriter
from server.kernel.clock import Clock
from server.live.hub import Hub
from server.storage.database import Database
from server.towers.core.place import Place
from wire.ids import DroneId

EVERY_S: Final = 10.0
"""How often it looks besides: the former tower may have stored an alert after the drone came."""
GATHERED_S: Final = 0.1
"""Drones that come within this time are looked up together."""
MAX_AT_ONCE: Final = 500
"""Drones whose alerts are read in one query."""
_log = structlog.get_logger(__name__)


class AlertTakeover:
    """One for a tower that shares a bus."""

    def __init__(
        self,
        hub: Hub,
        database: Database,
        clock: Clock,
        writer: AlertWriter,
        announcer: Announcer,
        *,
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        self._hub = hub
        self._database = database
        self._clock = clock
        self._writer = writer
        self._announcer = announcer
        self._monotonic = monotonic
        self._look_at = float("-inf")
        self._something = asyncio.Event()
        self._came: set[DroneId] = set()
        """Drones whose alerts that are over and wait for a person are to be read as well."""
        self._changed: set[int] = set()
        """Alerts that have changed here while the database was asked."""
        hub.alerts.listeners.append(self._note)

    def came(self, drone_id: DroneId) -> None:
        """The drone is at home here since now, and was not before."""
        self._came.add(drone_id)
        self._something.set()

    async def work(self) -> None:
        """Runs until cancelled."""
        while True:
            try:
                async with asyncio.timeout(EVERY_S):
                    await self._something.wait()
            except TimeoutError:
                pass
            self._something.clear()
            await asyncio.sleep(GATHERED_S)
            try:
                await self.take_over()
            except (SQLAlchemyError, OSError) as error:
                _log.error("alerts_not_taken_over_yet", error=type(error).__name__)
                await asyncio.sleep(1.0)

    async def take_over(self) -> int:
        """Returns how many. Raises SQLAlchemyError and OSError of the database."""
        came = set(islice(self._came, MAX_AT_ONCE))
        # What changes here from now on is known better here than what the database is about to answer.
        self._changed = {alert.id for alert in self._writer.waiting()}
        drones = came | await self._drones_with_others()
        found = await read_alerts(self._database, self._clock, of=drones, of_tower=self._hub.alerts.tower)
        ours = [alert for alert in found if self._is_ours(alert, came)]
        self._came -= came
        if self._came:
            self._something.set()
        if ours:
            restore_alerts(self._hub, self._announcer, ours, self._clock)
            _log.info("alerts_taken_over", count=len(ours))
        return len(ours)

    async def _drones_with_others(self) -> set[DroneId]:
        """Drones at home here with stored open alerts that this tower does not have; looked for now and then."""
        now = self._monotonic()
        if now < self._look_at:
            return set()
        stored = await read_open(self._database)
        self._look_at = now + EVERY_S
        return {one.drone_id for one in stored if one.drone_id is not None and self._lacks(one.id, one.drone_id)}

    def _lacks(self, alert_id: int, drone_id: DroneId) -> bool:
        drone = self._hub.state.drones.get(drone_id)
        is_here = drone is not None and drone.place is Place.HERE
        return is_here and alert_id not in self._changed and not self._hub.alerts.has(alert_id)

    def _is_ours(self, alert: Alert, came: set[DroneId]) -> bool:
        if alert.drone_id is None:  # of this tower, before its restart
            is_new = alert.id not in self._changed and not self._hub.alerts.has(alert.id)
            return is_new and alert.closed_at is None and alert.subject == self._hub.alerts.tower
        return self._lacks(alert.id, alert.drone_id) and (alert.closed_at is None or alert.drone_id in came)

    def _note(self, alert: Alert) -> None:
        self._changed.add(alert.id)
