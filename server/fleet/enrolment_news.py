"""Tells admins at their screens how enrolments go: begun, used, its agent seen, expired, cancelled."""

from __future__ import annotations

import asyncio
from datetime import datetime

import structlog
from pydantic import BaseModel
from sqlalchemy.exc import SQLAlchemyError

from server.clock import Clock
from server.database import Database
from server.fleet.enrolments import EnrolmentState, agent_seen, get_enrolment, state_of
from server.fleet.live_picture import LivePicture
from server.fleet.tables import DroneRow, EnrolmentRow
from wire.ids import DroneId

_log = structlog.get_logger(__name__)


class EnrolledDrone(BaseModel):
    id: int
    name: str


class EnrolmentView(BaseModel):
    """How an enrolment goes. Never its token."""

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


class EnrolmentNews:
    """One for a tower. `tell` and `expect_expiry` return at once and do the rest soon; `stop` ends what is left."""

    def __init__(self, database: Database, picture: LivePicture, clock: Clock) -> None:
        self._database = database
        self._picture = picture
        self._clock = clock
        self._at_work: set[asyncio.Task[None]] = set()
        self._timers: dict[int, asyncio.TimerHandle] = {}

    def tell(self, enrolment_id: int) -> None:
        """Its state has changed."""
        self._soon(self._tell(enrolment_id))

    def expect_expiry(self, enrolment_id: int, in_s: float) -> None:
        """If nobody uses it, admins hear of that too."""
        loop = asyncio.get_running_loop()
        self._timers[enrolment_id] = loop.call_later(in_s + 0.05, self._expired, enrolment_id)

    def agent_linked(self, drone_id: DroneId) -> None:
        """If it has come with a credential that was fetched by an enrolment, that one has come to its good end."""
        self._soon(self._agent_linked(drone_id))

    async def stop(self) -> None:
        for timer in self._timers.values():
            timer.cancel()
        for task in list(self._at_work):
            task.cancel()
        await asyncio.gather(*self._at_work, return_exceptions=True)

    def _expired(self, enrolment_id: int) -> None:
        self._timers.pop(enrolment_id, None)
        self.tell(enrolment_id)

    def _soon(self, work: object) -> None:
        task = asyncio.get_running_loop().create_task(self._carefully(work))
        self._at_work.add(task)
        task.add_done_callback(self._at_work.discard)

    async def _carefully(self, work: object) -> None:
        try:
            await work  # type: ignore[misc]
        except (SQLAlchemyError, OSError) as error:  # news, not truth: the list in the database is asked for anew
            _log.error("enrolment_news_lost", error=type(error).__name__)

    async def _tell(self, enrolment_id: int) -> None:
        async with self._database.reading() as session:
            found = await get_enrolment(session, enrolment_id)
        if found is not None:
            view = EnrolmentView.of(*found, self._clock())
            self._picture.tell_admins_of_enrolment(view.model_dump(mode="json"))

    async def _agent_linked(self, drone_id: DroneId) -> None:
        async with self._database.writing() as session:
            row = await agent_seen(session, drone_id=drone_id, at=self._clock())
        if row is not None:
            await self._tell(row.id)
