"""Closes the alerts that a tower left behind when it ended for good (server.alerts.core.left_alerts)."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Final

import structlog
from sqlalchemy.exc import SQLAlchemyError

from server.alerts.core.alert import Alert
from server.alerts.core.announcer import Announcer
from server.alerts.core.left_alerts import LeftAlerts, LeftDrone, OpenAlert, Why, why_left
from server.alerts.store.loading import read_open, read_open_of, restore_alerts
from server.alerts.store.writer import AlertWriter
from server.kernel.clock import Clock
from server.live.hub import Hub
from server.storage.database import Database
from wire.ids import DroneId

EVERY_S: Final = 10.0
_log = structlog.get_logger(__name__)


class LeftBehind:
    """One for a tower that shares a bus. `alert_towers`: under which names the running towers keep their own alerts;
    None if one of them is not known. `is_first`: whether this tower closes what belongs to none."""

    def __init__(
        self,
        hub: Hub,
        database: Database,
        clock: Clock,
        writer: AlertWriter,
        announcer: Announcer,
        *,
        alert_towers: Callable[[], frozenset[str] | None],
        is_first: Callable[[], bool],
    ) -> None:
        self._hub = hub
        self._database = database
        self._clock = clock
        self._writer = writer
        self._announcer = announcer
        self._alert_towers = alert_towers
        self._is_first = is_first
        self._left = LeftAlerts()
        self._changed: set[int] = set()
        """Alerts that have changed here while the database was asked."""
        hub.alerts.listeners.append(self._note)

    async def work(self) -> None:
        """Runs until cancelled."""
        while True:
            await asyncio.sleep(EVERY_S)
            try:
                await self.look(time.monotonic())
            except (SQLAlchemyError, OSError) as error:
                _log.error("left_alerts_not_closed_yet", error=type(error).__name__)

    async def look(self, now: float) -> int:
        """Returns how many it closed. `now`: monotonic seconds. Raises SQLAlchemyError and OSError of the database."""
        self._changed = {alert.id for alert in self._writer.waiting()}
        stored = {alert.id: alert for alert in await read_open(self._database)}
        due = self._left.due(self._found(stored), now)
        if not due:
            return 0
        alerts = await read_open_of(self._database, due.keys())
        # It may have come to a tower, or changed here, while the database answered.
        still = self._found(stored)
        closed = [alert for alert in alerts if alert.id in still and alert.id not in self._changed]
        for alert in closed:
            self._close(alert, due[alert.id])
        if closed:
            _log.info("left_alerts_closed", count=len(closed))
        return len(closed)

    def _found(self, stored: dict[int, OpenAlert]) -> dict[int, Why]:
        towers, is_first = self._alert_towers(), self._is_first()
        found = (
            (one.id, why_left(one, self._drone(one.drone_id), towers, is_first=is_first)) for one in stored.values()
        )
        return {alert_id: why for alert_id, why in found if why is not None}

    def _drone(self, drone_id: DroneId | None) -> LeftDrone | None:
        drone = None if drone_id is None else self._hub.state.drones.get(drone_id)
        if drone is None:
            return None
        hold = drone.open_hold.view(online=drone.online)
        was_heard = drone.last_heard.ever or drone.link is not None
        return LeftDrone(drone.record.name, drone.place, was_heard, hold is not None and hold.open)

    def _close(self, alert: Alert, why: str) -> None:
        alerts = self._hub.alerts
        if not alerts.has(alert.id):
            alert.closed_why = why
            restore_alerts(self._hub, self._announcer, [alert], self._clock)  # closes what has no drone
        alerts.end(alert.id, why)

    def _note(self, alert: Alert) -> None:
        self._changed.add(alert.id)
