"""Reports the progress of enrolments to admins: begun, used, agent seen, expired, cancelled."""

from __future__ import annotations

import asyncio
from datetime import datetime
from itertools import islice
from typing import Final

import structlog
from pydantic import BaseModel
from sqlalchemy.exc import SQLAlchemyError

from server.fleet.core.live_picture import LivePicture
from server.fleet.store.enrolments import (
    MAX_CONCURRENT,
    EnrolmentState,
    agents_seen,
    get_enrolment,
    just_seen,
    state_of,
)
from server.fleet.store.tables import DroneRow, EnrolmentRow
from server.kernel.clock import Clock
from server.storage.database import Database
from wire.ids import DroneId

TRY_AGAIN_AFTER_S: Final = 5.0
_log = structlog.get_logger(__name__)


class EnrolledDrone(BaseModel):
    id: int
    name: str


class EnrolmentView(BaseModel):
    """The progress of an enrolment, without its token."""

    id: int
    drone: EnrolledDrone
    created_by: str
    created_at: datetime
    expires_at: datetime
    state: EnrolmentState
    used_at: datetime | None
    used_from: str
    agent_seen_at: datetime | None

    @classmethod
    def of(cls, row: EnrolmentRow, drone: DroneRow, now: datetime) -> EnrolmentView:
        return cls(
            id=row.id,
            drone=EnrolledDrone(id=drone.id, name=drone.name),
            created_by=row.created_by,
            created_at=row.created_at,
            expires_at=row.expires_at,
            state=state_of(row, now),
            used_at=row.used_at,
            used_from=row.used_from,
            agent_seen_at=row.agent_seen_at,
        )


class EnrolmentNotifier:
    """One instance per tower. It publishes soon, and retries while the database is unreachable; `stop` ends that.

    After a restart of the tower thousands of agents link within a second, hardly any of them for the first time: they
    are looked up together, and nothing is written where nothing has changed.
    """

    def __init__(
        self,
        database: Database,
        picture: LivePicture,
        clock: Clock,
        *,
        try_again_after_s: float = TRY_AGAIN_AFTER_S,
    ) -> None:
        self._database = database
        self._picture = picture
        self._clock = clock
        self._try_again_after_s = try_again_after_s
        self._linked: dict[DroneId, datetime] = {}
        """When an agent last linked; not looked up yet."""
        self._changed: dict[int, None] = {}
        """Enrolments still to be published, in order."""
        self._working: asyncio.Task[None] | None = None
        self._timers: dict[int, asyncio.TimerHandle] = {}

    def publish(self, enrolment_id: int) -> None:
        """The state of an enrolment has changed."""
        self._changed[enrolment_id] = None
        self._work_soon()

    def expect_expiry(self, enrolment_id: int, in_s: float) -> None:
        """Publishes the expiry of an enrolment that is not used in time."""
        loop = asyncio.get_running_loop()
        self._timers[enrolment_id] = loop.call_later(in_s + 0.05, self._expired, enrolment_id)

    def agent_linked(self, drone_id: DroneId) -> None:
        """Marks an enrolment as seen if the agent has linked with its key."""
        self._linked[drone_id] = self._clock()
        self._work_soon()

    async def stop(self) -> None:
        for timer in self._timers.values():
            timer.cancel()
        if self._working is not None:
            self._working.cancel()
            await asyncio.gather(self._working, return_exceptions=True)

    def _expired(self, enrolment_id: int) -> None:
        self._timers.pop(enrolment_id, None)
        self.publish(enrolment_id)

    def _work_soon(self) -> None:
        if self._working is None or self._working.done():
            self._working = asyncio.get_running_loop().create_task(self._work())

    async def _work(self) -> None:
        in_reach = True
        while self._linked or self._changed:
            try:
                await self._look_up_links()
                await self._publish_changes()
                in_reach = True
            except (SQLAlchemyError, OSError) as error:
                if in_reach:
                    _log.warning("enrolment_event_late", error=type(error).__name__)
                in_reach = False
                await asyncio.sleep(self._try_again_after_s)

    async def _look_up_links(self) -> None:
        linked = dict(islice(self._linked.items(), MAX_CONCURRENT))
        if not linked:
            return
        async with self._database.reading() as session:
            seen = await just_seen(session, linked)
        if seen:
            async with self._database.writing() as session:
                seen = await agents_seen(session, linked)
        for drone_id, at in linked.items():
            if self._linked[drone_id] == at:  # else it has linked again
                del self._linked[drone_id]
        self._changed.update(dict.fromkeys(row.id for row in seen))

    async def _publish_changes(self) -> None:
        while self._changed:
            enrolment_id = next(iter(self._changed))
            del self._changed[enrolment_id]  # a change during the read is published again
            try:
                async with self._database.reading() as session:
                    found = await get_enrolment(session, enrolment_id)
            except (SQLAlchemyError, OSError):
                self._changed[enrolment_id] = None
                raise
            if found is not None:
                view = EnrolmentView.of(*found, self._clock())
                self._picture.notify_admins_of_enrolment(view.model_dump(mode="json"))
