"""The rules of loans: a drone, to a user, until a time, within limits; and the service that ends expired ones.

Every rule takes a session of `Database.writing()`, so that a change and its audit record are committed together.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final

import structlog
from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.users import UnknownUser, get_user
from server.audit.store.action import AuditAction
from server.audit.store.trail import TOWER
from server.fleet.core.live_picture import LivePicture
from server.fleet.store.drones import get_drone
from server.fleet.store.roster import Roster
from server.fleet.store.snapshot import begin_fleet_change, ties_of
from server.fleet.store.tables import LoanRow
from server.kernel.access import Action, AdminsOnly, Reach, UnknownDrone, reach_of
from server.kernel.clock import Clock
from server.kernel.people import Principal, Role
from server.kernel.refusal import Refusal
from server.kernel.relations import Relation, Right, may, relation_by_ties, relation_of
from server.runtime.aligned_timers import rest
from server.storage.database import Database
from server.teams.store.tables import TeamDroneRow
from wire.ids import UserId

MAX_LOAN: Final = timedelta(days=366)
CHECK_EVERY_S: Final = 0.25
NO_LIMITS: Final = (Relation.TEAM_ADMIN, Relation.OWNER, Relation.TEAM_OPERATOR)
"""Users with these relations fly the drone without a loan."""
_log = structlog.get_logger(__name__)


class OwnerAlready(Refusal):
    def __init__(self) -> None:
        super().__init__("this user may fly the drone already: a loan is not needed")


class BadLoan(Refusal):
    """The end of the loan is not allowed."""


@dataclass(frozen=True)
class Terms:
    until: datetime
    may_arm: bool
    max_height_m: float | None
    radius_m: float | None


async def lend(
    session: AsyncSession, *, drone_id: int, user_id: int, terms: Terms, lender: Principal, action: AuditAction
) -> None:
    """Lending again changes the terms. A team admin lends drones of the team to its observers.

    Raises BadLoan, UnknownDrone, AdminsOnly, UnknownUser, OwnerAlready.
    """
    await begin_fleet_change(session)
    drone = await get_drone(session, drone_id)
    team_id = await _lends_for(session, drone_id=drone_id, user_id=user_id, lender=lender, action=action)
    if not action.at < terms.until <= action.at + MAX_LOAN:
        raise BadLoan("a loan ends in the future, within a year")
    user = await get_user(session, user_id)
    ties = await ties_of(session, drone_id, action.at)
    if relation_by_ties(ties, UserId(user_id)) in NO_LIMITS:
        raise OwnerAlready
    if reach_of(Role(user.role), Action.FLY) is Reach.NONE:
        raise BadLoan("an observer cannot fly: make the account an operator first")
    row = await session.get(LoanRow, (drone_id, user_id))
    if row is None:
        row = LoanRow(drone_id=drone_id, user_id=user_id)
        session.add(row)
    row.until, row.may_arm = terms.until, terms.may_arm
    row.max_height_m, row.radius_m = terms.max_height_m, terms.radius_m
    row.team_id = team_id
    action.record(
        session,
        "drone.lent",
        drone_id=drone_id,
        drone=drone.name,
        user_id=user_id,
        user=user.name,
        until=terms.until.isoformat(),
        may_arm=terms.may_arm,
        max_height_m=terms.max_height_m,
        radius_m=terms.radius_m,
    )


async def end_loan(
    session: AsyncSession, *, drone_id: int, user_id: int, lender: Principal, action: AuditAction
) -> None:
    """Ending a loan that does not exist changes nothing. Raises UnknownDrone, AdminsOnly, UnknownUser."""
    await begin_fleet_change(session)
    drone = await get_drone(session, drone_id)
    await _lends_for(session, drone_id=drone_id, user_id=user_id, lender=lender, action=action)
    user = await get_user(session, user_id)
    row = await session.get(LoanRow, (drone_id, user_id))
    if row is not None:
        await session.delete(row)
        action.record(session, "drone.loan_ended", drone_id=drone_id, drone=drone.name, user_id=user_id, user=user.name)


async def _lends_for(
    session: AsyncSession, *, drone_id: int, user_id: int, lender: Principal, action: AuditAction
) -> int | None:
    """Returns the team for which this user lends the drone to that user, or ends the loan; None: for the tower.

    A team admin cannot lend to people outside the team, nor change a loan of an admin of the tower. Raises
    UnknownDrone, AdminsOnly, UnknownUser.
    """
    ties = await ties_of(session, drone_id, action.at)
    relation = relation_of(ties, lender.user_id, lender.role)
    if relation is Relation.ADMIN:
        return None
    if relation is Relation.STRANGER:
        raise UnknownDrone
    if not may(relation, Right.LEND):
        raise AdminsOnly
    if user_id not in ties.crew:
        raise UnknownUser
    team_id = await session.scalar(select(TeamDroneRow.team_id).where(TeamDroneRow.drone_id == drone_id))
    row = await session.get(LoanRow, (drone_id, user_id))
    if row is not None and row.team_id != team_id:
        raise AdminsOnly
    return team_id


class LoanExpiry:
    """Ends loans on time: at once in the live picture, even if the database is unreachable, then in the database."""

    def __init__(self, database: Database, picture: LivePicture, roster: Roster, clock: Clock) -> None:
        self._database = database
        self._picture = picture
        self._roster = roster
        self._clock = clock
        self._to_write = True

    async def watch(self) -> None:
        """Runs until cancelled."""
        while True:
            self._to_write = self._picture.end_loans(self._clock()) or self._to_write
            if self._to_write:
                try:
                    await self._write()
                except (SQLAlchemyError, OSError) as error:
                    _log.error("loan_end_not_written", error=type(error).__name__)
            await rest(CHECK_EVERY_S)

    async def _write(self) -> None:
        now = self._clock()
        async with self._database.writing() as session:
            over = (await session.scalars(select(LoanRow).where(LoanRow.until <= now))).all()
            if over:
                await begin_fleet_change(session)
            for row in over:
                action = AuditAction(by=TOWER, at=now)
                action.record(session, "drone.loan_expired", drone_id=row.drone_id, user_id=row.user_id)
                await session.delete(row)
        self._to_write = False
        if over:
            await self._roster.refresh()
